// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/sensing/sensing_head.hpp"

#include <cstdio>
#include <utility>

#include "client/replay/score.hpp"
#include "common/linalg/blas_threads.hpp"
#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/io/config/config_file.hpp"

namespace brainshift::sensing {

Result<bench::Head> make_default_head(double thousand_nodes, double swelling_strain_sd) {
  linalg::use_single_threaded_blas();
  auto config = io::read_case_config(BRAINSHIFT_DEFAULT_CASE);
  if (!config) return tl::unexpected(config.error());
  config->prior.swelling_strain_sd = swelling_strain_sd;
  bench::MeshWish wish;
  wish.name = "sensing";
  wish.thousand_nodes = thousand_nodes;
  auto head = bench::make_head(std::move(*config), wish);
  if (head) {
    std::printf("head: %d nodes, %zu slaves, prepared in %.1f s\n", head->model->mesh.num_nodes(),
                head->model->slaves.size(), head->mesh_s + head->condense_s);
  }
  return head;
}

Surgery::Surgery(std::shared_ptr<inversion::CondensedInverter> inverter,
                 std::shared_ptr<const server::Pipeline> pipeline, double max_age_s)
    : inverter_(std::move(inverter)), pipeline_(std::move(pipeline)), evidence_(max_age_s) {}

Result<Surgery> Surgery::begin(const bench::Head& head, const CaseConfig& config) {
  auto made = inversion::CondensedInverter::build(head.operators, head.locator, config);
  if (!made) return tl::unexpected(made.error());
  auto inverter = std::make_shared<inversion::CondensedInverter>(std::move(*made));
  auto pipeline = server::Pipeline::build(
      head.model, config, Boundary::kContact,
      [inverter](const SparseData& data,
                 const inversion::InversionOptions& options) -> Result<Estimate> {
        Estimate estimate;
        if (auto status = inverter->update(data, estimate, options.moving); !status) {
          return tl::unexpected(status.error());
        }
        return estimate;
      });
  if (!pipeline) return tl::unexpected(pipeline.error());
  return Surgery(std::move(inverter),
                 std::make_shared<const server::Pipeline>(std::move(*pipeline)),
                 config.sensing.max_age_s);
}

Result<Update> Surgery::observe(const Observation& observation) {
  server::RunOptions options;
  options.method = Method::kCondensed;
  return pipeline_->run(observation, options, evidence_);
}

void Surgery::restart() {
  inverter_->reset();
  evidence_.clear();
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
