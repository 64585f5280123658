// SPDX-License-Identifier: GPL-3.0-or-later
// What the guards of an update cost on the default head: the checks of
// estimate_check.hpp, compared with the whole update.
//   build/release/bin/bench_guards [OUT.csv] [case.yaml]
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numeric>

#include "client/tools/twin/surgery.hpp"
#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/inversion/contract/estimate_check.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "common/linalg/openblas.hpp"
#include "common/patient/read_patient.hpp"
#include "tests/benchmarks/tools.hpp"

namespace brainshift {
namespace {

using bench::value_or_exit;

template <typename Work>
double median_ms(const Work& work) {
  return bench::median_ms(work, 50, 10);
}

void run(const std::string& out, const std::string& case_file) {
  auto [config, brain] = value_or_exit(patient::read_patient(case_file));
  const auto model = std::make_shared<const BrainModel>(std::move(brain));
  const auto prepared =
      value_or_exit(inversion::PreparedModel::prepare(model, config, Boundary::kContact));
  const auto operators =
      std::make_shared<const CondensedOperators>(value_or_exit(inversion::condense(prepared)));
  const auto locator = std::make_shared<const geometry::TetLocator>(model->mesh);
  auto inverter = value_or_exit(inversion::CondensedInverter::build(operators, locator, config));
  const auto surgery =
      value_or_exit(client::play_scenario(*model, config, *client::find_scenario("paper"), 1));
  const auto& pairs = std::get<LandmarkPairs>(surgery.observations.front().body);
  const SparseData data{pairs.undeformed, pairs.deformed - pairs.undeformed,
                        VecX::Constant(pairs.undeformed.cols(), config.inversion.sigma_mm)};

  Estimate estimate;
  const double update_ms = median_ms([&] {
    if (!inverter.update(data, estimate)) std::exit(1);
  });
  ThreadTeam team;
  fem::DeformationCheck check(model->mesh.nodes, model->mesh.tets, team);
  fem::Deformation deformation;
  const double deformation_ms =
      median_ms([&] { deformation = check.measure(estimate.displacement); });
  std::vector<int> slaves(static_cast<std::size_t>(operators->num_slaves()));
  std::iota(slaves.begin(), slaves.end(), 0);
  const VecX penetration = prepared.forward().contact().penetration(estimate.displacement);
  const double equilibrium_ms = median_ms([&] {
    if (!inversion::check_equilibrium(*operators, slaves, penetration, estimate.displacement)) {
      std::exit(1);
    }
  });
  const double share = 100.0 * (deformation_ms + equilibrium_ms) / update_ms;
  std::printf("%d nodes, %d tetrahedra, %d slaves, smallest volume ratio %.3f\n",
              model->mesh.num_nodes(), model->mesh.num_tets(), operators->num_slaves(),
              deformation.min_volume_ratio);
  std::printf("update %.2f ms (p50), det F %.3f ms, equilibrium %.3f ms: %.1f %% of an update\n",
              update_ms, deformation_ms, equilibrium_ms, share);
  if (out.empty()) return;
  std::ofstream file(out);
  file << "name,value\nupdate_ms," << update_ms << "\ndeformation_ms," << deformation_ms
       << "\nequilibrium_ms," << equilibrium_ms << "\nshare_percent," << share << "\n";
  if (!file.flush()) {
    std::fprintf(stderr, "bench_guards: %s: cannot be written\n", out.c_str());
    std::exit(1);
  }
}

}  // namespace
}  // namespace brainshift

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::run(argc > 1 ? argv[1] : "", argc > 2 ? argv[2] : BRAINSHIFT_DEFAULT_CASE);
  return 0;
}
