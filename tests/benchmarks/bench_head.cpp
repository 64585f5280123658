// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/bench_head.hpp"

#include <cmath>
#include <fstream>
#include <sstream>
#include <utility>

#include "common/anatomy/brain_model_builder.hpp"
#include "common/contact/forward_model.hpp"
#include "common/core/stopwatch.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "common/io/config/config_file.hpp"
#include "tests/benchmarks/tools.hpp"

namespace brainshift::bench {
namespace {

// The edge of the default case gives 18 thousand nodes. Other cases
// get meshes of other sizes; mesh_row() has the count.
constexpr double kReferenceThousandNodes = 18.0;

// Linux: writing 5 to clear_refs sets the peak back to the memory held now. Where that fails, the
// peak is that of the whole process.
void reset_peak_rss() { std::ofstream("/proc/self/clear_refs") << "5"; }

std::uint64_t peak_rss_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmHWM:", 0) != 0) continue;
    std::istringstream fields(line.substr(6));
    std::uint64_t kib = 0;
    fields >> kib;
    return 1024 * kib;
  }
  return 0;
}

}  // namespace

Status scale_edges(CaseConfig& config, const MeshWish& wish) {
  auto* mesh = std::get_if<MeshGeneration>(&config.mesh);
  if (mesh == nullptr) {
    return invalid(config.file.string() +
                   ": mesh.file: a ready mesh cannot be made in other sizes");
  }
  const double scale = std::cbrt(kReferenceThousandNodes / wish.thousand_nodes);
  mesh->edge_mm *= scale;
  mesh->tumour_edge_mm *= scale * wish.local_factor;
  mesh->craniotomy_edge_mm *= scale * wish.local_factor;
  return validate(config);
}

Result<Head> make_head(CaseConfig config, const MeshWish& wish, const Progress& progress) {
  if (Status ok = scale_edges(config, wish); !ok) return tl::unexpected(ok.error());
  reset_peak_rss();
  Head head;
  head.name = wish.name;
  const auto inputs = io::load_case_inputs(config);
  if (!inputs) return tl::unexpected(inputs.error());
  Stopwatch watch;
  auto model = anatomy::build_brain_model(*inputs, progress);
  if (!model) return tl::unexpected(model.error());
  head.mesh_s = watch.seconds();
  head.model = std::make_shared<const BrainModel>(std::move(*model));
  auto prepared =
      inversion::PreparedModel::prepare(head.model, config, Boundary::kContact, progress);
  if (!prepared) return tl::unexpected(prepared.error());
  head.prepared = std::make_shared<const inversion::PreparedModel>(std::move(*prepared));
  inversion::CondenseOptions options;
  options.progress = progress;
  watch = Stopwatch();
  auto operators = inversion::condense(*head.prepared, options);
  if (!operators) return tl::unexpected(operators.error());
  head.condense_s = watch.seconds();
  head.peak_rss_bytes = peak_rss_bytes();
  head.operators = std::make_shared<const CondensedOperators>(std::move(*operators));
  head.locator = std::make_shared<const geometry::TetLocator>(head.model->mesh);
  head.config = std::move(config);
  return head;
}

std::vector<std::string> mesh_row(const Head& head) {
  const auto& mesh = std::get<MeshGeneration>(head.config.mesh);
  const inversion::PrepareTimings& timings = head.prepared->timings();
  return {head.name,
          std::to_string(head.model->mesh.num_nodes()),
          std::to_string(head.model->mesh.num_tets()),
          std::to_string(head.operators->num_slaves()),
          csv_number(mesh.edge_mm),
          csv_number(mesh.tumour_edge_mm),
          std::to_string(head.operators->num_modes()),
          csv_number(head.mesh_s),
          csv_number(timings.analyse_s + timings.factor_s),
          csv_number(timings.total_s),
          csv_number(contact::measure_full_solve_ms(head.prepared->forward())),
          csv_number(head.condense_s),
          std::to_string(head.operators->bytes()),
          std::to_string(timings.bytes),
          std::to_string(head.peak_rss_bytes)};
}

}  // namespace brainshift::bench
