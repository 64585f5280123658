// SPDX-License-Identifier: GPL-3.0-or-later
// The same measurements with and without gross errors (gross_errors.hpp) in a fifth of the points.
#include <cstdio>
#include <string>
#include <vector>

#include "common/core/random.hpp"
#include "tests/sensing/estimate_studies.hpp"
#include "tests/sensing/sensing_head.hpp"
#include "tests/simulation/variation.hpp"
#include "tests/support/gross_errors.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift::sensing {
namespace {

constexpr int kOutlierTruths =
    10;  // surgeries that differ as tests/simulation/variation.hpp has it
constexpr int kMeasurements = 2;

using Surgeries = std::vector<client::SimulatedSurgery>;

Result<Surgeries> play_outliers(const bench::Head& head, const char* name) {
  Surgeries surgeries;
  for (std::uint64_t seed = 1; seed <= kOutlierTruths; ++seed) {
    client::Scenario scenario = client::vary(*client::find_scenario(name), seed);
    scenario.fluid_levels_mm.assign(kMeasurements, scenario.fluid_levels_mm.front());
    auto surgery =
        client::play_scenario(*head.model, head.config, head.prepared->forward(), scenario, seed);
    if (!surgery) return tl::unexpected(surgery.error());
    surgeries.push_back(std::move(*surgery));
  }
  return surgeries;
}

// Mean tumour error over all updates.
Result<double> tumour_error(const bench::Head& head, const CaseConfig& config,
                            const Surgeries& surgeries, double fraction) {
  auto session = begin_surgery(head, config);
  if (!session) return tl::unexpected(session.error());
  Random random(5);
  double sum = 0.0;
  int updates = 0;
  for (const auto& surgery : surgeries) {
    session->reset();
    for (std::size_t i = 0; i < surgery.observations.size(); ++i) {
      const auto update =
          session->run(test_support::with_gross_errors(surgery.observations[i], fraction, random));
      if (!update) return tl::unexpected(update.error());
      const auto run = score_update(head, surgery.truths[i], *update);
      if (!run) return tl::unexpected(run.error());
      sum += run->error_mm.cross->mean;
      ++updates;
    }
  }
  return sum / updates;
}

}  // namespace

Status outlier_study(const bench::Head& head) {
  for (const auto& [name, what] :
       {std::pair{"paper-icp", "boundary points"}, std::pair{"paper", "displacements"},
        std::pair{"joint-sag", "boundary points and vessel forks"}}) {
    const auto surgeries = play_outliers(head, name);
    if (!surgeries) return tl::unexpected(surgeries.error());
    double clean = 0.0;
    for (const double fraction : {0.0, 0.1, 0.2, 0.3}) {
      const auto error = tumour_error(head, head.config, *surgeries, fraction);
      if (!error) return tl::unexpected(error.error());
      if (fraction == 0.0) clean = *error;
      std::printf("outliers: %-16s %2.0f %%: tumour error %.4f mm\n", what, 100.0 * fraction,
                  *error);
      test_support::record(
          {"outliers", what, "gross outliers %", "tumour error mm", 100.0 * fraction, *error});
      if (fraction != 0.2) continue;
      char text[60];
      std::snprintf(text, sizeof text, "<= 1.2 (%.4f to %.4f mm)", clean, *error);
      const std::string figure =
          std::string("tumour error with 20 % among ") + what + " over that without";
      test_support::record_check("outliers", figure, *error / clean, text, *error <= 1.2 * clean,
                                 "twin; 10 surgeries of 2 measurements");
    }
  }
  return {};
}

}  // namespace brainshift::sensing
