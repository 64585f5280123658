// SPDX-License-Identifier: GPL-3.0-or-later
// Surgeries of every joint scenario, each another truth (tests/simulation/variation.hpp). The
// first update of a surgery knows the tumour's boundary only, the second the stereo camera's
// surface too, the third the tracked points.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "common/contact/forward_model.hpp"
#include "common/core/statistics.hpp"
#include "tests/benchmarks/csv_table.hpp"
#include "tests/sensing/estimate_studies.hpp"
#include "tests/sensing/sensing_head.hpp"
#include "tests/simulation/variation.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift::sensing {
namespace {

using test_support::record_check;

constexpr int kTruths = 10;
const char* const kScenarios[] = {"joint-sag", "joint-distension", "joint-tangential",
                                  "joint-mixed"};
const char* const kSources[] = {"ius", "stereopsis", "tracks"};
constexpr int kStages = 3;

// Over the surgeries, by stage: the newest source of the update.
struct Stage {
  std::vector<double> tumour_mm, craniotomy_mm, craniotomy_vector_mm, coverage, time_ms;
  int contradictions = 0;
};
using Stages = std::array<Stage, kStages>;

double mean(const std::vector<double>& values) { return mean_std(values).mean; }

void add(const client::RunReport& run, const Update& update, Stage& stage) {
  stage.tumour_mm.push_back(run.error_mm.cross->mean);
  stage.craniotomy_mm.push_back(run.error_mm.craniotomy->mean);
  stage.craniotomy_vector_mm.push_back(run.error_mm.craniotomy_displacement->mean);
  stage.coverage.push_back(*run.coverage_90);
  stage.time_ms.push_back(update.timings.register_ms + update.timings.invert_ms +
                          update.timings.rebuild_ms);
  for (const SourceSummary& source : update.estimate.sources) {
    stage.contradictions += source.consistent ? 0 : 1;
  }
}

Result<Stages> play(const bench::Head& head, const client::Scenario& scenario) {
  auto session = begin_surgery(head, head.config);
  if (!session) return tl::unexpected(session.error());
  Stages stages;
  for (std::uint64_t seed = 1; seed <= kTruths; ++seed) {
    client::Scenario varied = client::vary(scenario, seed);
    varied.fluid_levels_mm.resize(1);
    const auto surgery =
        client::play_scenario(*head.model, head.config, head.prepared->forward(), varied, seed);
    if (!surgery) return tl::unexpected(surgery.error());
    session->reset();
    for (std::size_t i = 0; i < surgery->observations.size(); ++i) {
      const auto update = session->run(surgery->observations[i]);
      if (!update) return tl::unexpected(update.error());
      const auto run = score_update(head, surgery->truths[i], *update);
      if (!run) return tl::unexpected(run.error());
      add(*run, *update, stages[i % kStages]);
    }
  }
  return stages;
}

void check(const std::string& study, const std::string& scenario, const Stages& stages) {
  const Stage &alone = stages.front(), &all = stages.back();
  const auto ratio = [&](const char* what, const std::vector<double> Stage::*errors, double bound) {
    const double value = mean(all.*errors) / mean(alone.*errors);
    const std::string name = scenario + ": " + what + " error over that of the tumour alone";
    char text[80];
    std::snprintf(text, sizeof text, "<= %g (%.3f to %.3f mm)", bound, mean(alone.*errors),
                  mean(all.*errors));
    record_check(study, name, value, text, value <= bound, "twin; mean of 10 surgeries");
  };
  ratio("craniotomy (closest point)", &Stage::craniotomy_mm, 0.5);
  ratio("craniotomy (displacement; sliding included)", &Stage::craniotomy_vector_mm, 0.5);
  ratio("tumour", &Stage::tumour_mm, 1.0);
}

// joint.csv, a row per surgery and stage, which tests/studies/sensing.py draws.
Status write(const std::vector<Stages>& results, const std::filesystem::path& path) {
  auto file = bench::CsvWriter::create(
      path, "scenario,seed,newest_source,tumour_mm,craniotomy_mm,craniotomy_vector_mm,coverage_90");
  if (!file) return tl::unexpected(file.error());
  for (std::size_t k = 0; k < results.size(); ++k) {
    for (std::size_t i = 0; i < results[k].front().tumour_mm.size(); ++i) {
      for (std::size_t s = 0; s < kStages; ++s) {
        const Stage& stage = results[k][s];
        std::vector<std::string> cells = {kScenarios[k], std::to_string(i + 1), kSources[s]};
        for (const double value : {stage.tumour_mm[i], stage.craniotomy_mm[i],
                                   stage.craniotomy_vector_mm[i], stage.coverage[i]}) {
          cells.push_back(bench::csv_number(value));
        }
        if (Status ok = file->row(cells); !ok) return ok;
      }
    }
  }
  return {};
}

// `study`: file-name-like.
Status measure(const bench::Head& head, const std::string& study) {
  std::printf("%s: errors in mm, mean of %d surgeries\n", study.c_str(), kTruths);
  std::vector<Stages> results;
  std::vector<double> joint_ms;
  for (const char* name : kScenarios) {
    auto stages = play(head, *client::find_scenario(name));
    if (!stages)
      return fail(stages.error().code, std::string(name) + ": " + stages.error().message);
    for (std::size_t s = 0; s < kStages; ++s) {
      const Stage& stage = (*stages)[s];
      std::printf(
          "  %-17s %-11s tumour %.3f craniotomy %.3f by displacement %.3f coverage %.2f "
          "contradictions %d time %.1f ms\n",
          name, kSources[s], mean(stage.tumour_mm), mean(stage.craniotomy_mm),
          mean(stage.craniotomy_vector_mm), mean(stage.coverage), stage.contradictions,
          percentile(stage.time_ms, 50));
    }
    check(study, name, *stages);
    const auto& times = stages->back().time_ms;
    joint_ms.insert(joint_ms.end(), times.begin(), times.end());
    results.push_back(std::move(*stages));
  }
  const double solve_ms = contact::measure_full_solve_ms(head.prepared->forward());
  const double solves = percentile(joint_ms, 50) / solve_ms;
  record_check(study, "update with three sources over one solve: p50", solves, "<= 2",
               solves <= 2.0, "t_solve of the same process");
  if (const char* folder = std::getenv("BRAINSHIFT_STUDY_DIR"); folder != nullptr) {
    return write(results, std::filesystem::path(folder) / (study + ".csv"));
  }
  return {};
}

}  // namespace

Status joint_study(const bench::Head& head) { return measure(head, "joint"); }

}  // namespace brainshift::sensing
