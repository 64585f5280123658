// SPDX-License-Identifier: GPL-3.0-or-later
// Tumour boundary and exposed cortex together: how much better than the tumour alone?
//
// Every joint scenario is measured several times with noise drawn anew. The first update of a measurement knows the
// tumour's boundary only, the second the stereo camera's surface too, the third the tracked points.
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "tests/sensing/sensing_head.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift::sensing {
namespace {

constexpr int kMeasurements = 6;
const char* const kScenarios[] = {"joint-sag", "joint-distension", "joint-tangential",
                                  "joint-mixed"};

struct Errors {
  double tumour = 0.0, craniotomy = 0.0, cortex_vector = 0.0, field = 0.0, coverage = 0.0;
  double milliseconds = 0.0;
  int updates = 0;
};

void add(const client::RunReport& run, const Update& update, Errors& errors) {
  errors.tumour += run.error_mm.cross->mean;
  errors.craniotomy += run.error_mm.craniotomy->mean;
  errors.cortex_vector += run.error_mm.craniotomy_displacement->mean;
  errors.field += 0.01 * run.field_error_pct->p50 * *run.largest_true_displacement_mm;
  errors.coverage += *run.coverage_90;
  errors.milliseconds += update.timings.invert_ms + update.timings.rebuild_ms;
  ++errors.updates;
}

Errors mean(Errors sum) {
  const double n = sum.updates;
  return {sum.tumour / n,   sum.craniotomy / n,   sum.cortex_vector / n, sum.field / n,
          sum.coverage / n, sum.milliseconds / n, sum.updates};
}

// By the newest source: "ius", "stereopsis", "tracks".
Result<std::map<std::string, Errors>> play(const bench::Head& head, twin::Scenario scenario) {
  scenario.fluid_levels_mm.assign(kMeasurements, scenario.fluid_levels_mm.front());
  const auto surgery =
      twin::play_scenario(*head.model, head.config, head.prepared->forward(), scenario, 1);
  if (!surgery) return tl::unexpected(surgery.error());
  auto session = Surgery::begin(head, head.config);
  if (!session) return tl::unexpected(session.error());
  std::map<std::string, Errors> sums;
  for (std::size_t i = 0; i < surgery->observations.size(); ++i) {
    const auto update = session->observe(surgery->observations[i]);
    if (!update) return tl::unexpected(update.error());
    const auto run = score_update(head, surgery->truths[i], *update);
    if (!run) return tl::unexpected(run.error());
    add(*run, *update, sums[surgery->observations[i].source]);
    std::printf("    %-10s %.3f %.3f %.3f | %s\n", surgery->observations[i].source.c_str(),
                run->error_mm.cross->mean, run->error_mm.craniotomy->mean,
                run->error_mm.craniotomy_displacement->mean, update->estimate.reason.c_str());
    std::printf("       active %d pen %.4f scales %.3f %.3f %.3f %.3f misfit %.3f\n", update->estimate.contact.active, update->estimate.contact.max_penetration_mm, update->estimate.prior_scales[0], update->estimate.prior_scales[1], update->estimate.prior_scales[2], update->estimate.prior_scales[3], update->estimate.misfit_mm.mean);
    for (const auto& h : update->estimate.history) std::printf(" %.3f/%d", h.max_penetration_mm, h.penetrating);
    std::printf("\n");
    for (const auto& source : update->estimate.sources) {
      std::printf("        %s: %d data, %d outliers, chi2 %.1f / %.1f p %.2g\n",
                  source.source.c_str(), source.data, source.outliers, source.chi_square,
                  source.degrees_of_freedom, source.p_value);
    }
  }
  for (auto& [source, errors] : sums) errors = mean(errors);
  return sums;
}

int run(int argc, char** argv) {
  const char* size = std::getenv("SENSING_THOUSAND_NODES");
  const auto head = make_default_head(size != nullptr ? std::atof(size) : 18.0);
  if (!head) {
    std::fprintf(stderr, "sensing_joint: %s\n", head.error().message.c_str());
    return 1;
  }
  std::vector<const char*> names(std::begin(kScenarios), std::end(kScenarios));
  if (argc > 1) names.assign(argv + 1, argv + argc);
  for (const char* name : names) {
    const auto errors = play(*head, *twin::find_scenario(name));
    if (!errors) {
      std::fprintf(stderr, "sensing_joint: %s: %s\n", name, errors.error().message.c_str());
      return 1;
    }
    for (const char* source : {"ius", "stereopsis", "tracks"}) {
      if (errors->count(source) == 0) continue;
      const Errors& one = errors->at(source);
      std::printf("%-18s %-12s tumour %.4f  craniotomy %.4f  vector %.4f field %.4f coverage %.3f  %.1f ms\n", name,
                  source, one.tumour, one.craniotomy, one.cortex_vector, one.field, one.coverage,
                  one.milliseconds);
    }
  }
  return 0;
}

}  // namespace
}  // namespace brainshift::sensing

int main(int argc, char** argv) { return brainshift::sensing::run(argc, argv); }
