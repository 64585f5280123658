// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/sensing/sensing_head.hpp"

#include <cstdio>
#include <utility>

#include "client/tools/replay/score.hpp"
#include "common/inversion/inverter.hpp"
#include "common/io/config/config_file.hpp"
#include "common/linalg/openblas.hpp"

namespace brainshift::sensing {

Result<bench::Head> make_default_head(double thousand_nodes) {
  linalg::use_single_threaded_blas();
  auto config = io::read_case_config(BRAINSHIFT_DEFAULT_CASE);
  if (!config) return tl::unexpected(config.error());
  const bench::MeshWish wish{"sensing", thousand_nodes};
  auto head = bench::make_head(std::move(*config), wish);
  if (head) {
    std::printf("head: %d nodes, %zu slaves, prepared in %.1f s\n", head->model->mesh.num_nodes(),
                head->model->slaves.size(), head->mesh_s + head->condense_s);
  }
  return head;
}

Result<pipeline::Pipeline> begin_surgery(const bench::Head& head, const CaseConfig& config) {
  auto inverter = inversion::condensed_inverter(head.operators, head.locator, config);
  if (!inverter) return tl::unexpected(inverter.error());
  return pipeline::Pipeline::build(*head.model, config, Method::kCondensed, Boundary::kContact,
                                   std::move(*inverter));
}

Result<client::RunReport> score_update(const bench::Head& head, const io::SurgeryTruth& truth,
                                       const Update& update) {
  client::RunReport run;
  client::describe(*head.model, update.estimate, run);
  if (Status ok = client::score(*head.model, truth, update.estimate, run); !ok) {
    return tl::unexpected(ok.error());
  }
  return run;
}

}  // namespace brainshift::sensing
