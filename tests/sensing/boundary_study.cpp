// SPDX-License-Identifier: GPL-3.0-or-later
// The tumour's boundary as distances to its deformed surface, against displacements of its rigid
// alignment (docs/decisions/0020). Every surgery is estimated by each guide from the same data, at
// its second moment: with the tumour alone, as the data of the first moment are too old by then,
// and with all sources. Each seed draws noise and stiffness (30 %) anew.
#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/core/statistics.hpp"
#include "common/inversion/inverter.hpp"
#include "tests/sensing/estimate_studies.hpp"
#include "tests/sensing/sensing_head.hpp"
#include "tests/simulation/variation.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift::sensing {
namespace {

const char* const kBoundaryScenarios[] = {"paper-icp", "joint-sag", "joint-distension",
                                          "joint-tangential", "joint-mixed"};
constexpr int kSeeds = 4;
constexpr double kStiffnessSd = 0.3;
// The fluid stood so much higher at the first moment, which nothing but a warm start remembers.
constexpr double kEarlier_mm = 15.0;
constexpr std::int64_t kLater_ns = 3'600'000'000'000;

struct Guide {
  const char* name;
  SurfaceGuidance tumour;
  double probe_pose_sd;  // mm and degrees
  int points;
  bool cold;
};
constexpr Guide kGuides[] = {
    {"rigid", SurfaceGuidance::kRigid, 0.0, 200, false},
    {"distances", SurfaceGuidance::kDistances, 0.5, 200, false},
    {"distances cold", SurfaceGuidance::kDistances, 0.5, 200, true},
    {"distances probe exact", SurfaceGuidance::kDistances, 0.0, 200, false},
    {"distances probe 1 mm", SurfaceGuidance::kDistances, 1.0, 200, false},
    {"distances 400 points", SurfaceGuidance::kDistances, 0.5, 400, false},
};
constexpr std::size_t kWarm = 1, kCold = 2;  // the same but for the start

// Counts how often an update made its data anew; `cold` forgets earlier updates.
class WatchedInverter final : public inversion::Inverter {
 public:
  WatchedInverter(std::unique_ptr<inversion::Inverter> inner, bool cold, int& rounds)
      : inner_(std::move(inner)), cold_(cold), rounds_(rounds) {}
  void reset() override { inner_->reset(); }
  std::optional<inversion::OmissionErrors> omission_errors() const override {
    return inner_->omission_errors();
  }
  std::uint64_t bytes() const override { return inner_->bytes(); }

 private:
  Status invert(const SparseData& data, const inversion::InversionOptions& options,
                Estimate& estimate) override {
    if (cold_) inner_->reset();
    rounds_ = 0;
    inversion::InversionOptions watched = options;
    inversion::MovingData moving;
    if (options.moving != nullptr) {
      moving.nodes = options.moving->nodes;
      moving.relocate = [&](const Points& u, SparseData& now) {
        const bool moved = options.moving->relocate(u, now);
        rounds_ += moved ? 1 : 0;
        return moved;
      };
      watched.moving = &moving;
    }
    return inner_->update(data, watched, estimate);
  }

  std::unique_ptr<inversion::Inverter> inner_;
  bool cold_;
  int& rounds_;
};

// Of one guide and stage (0: the tumour alone, 1: all sources), by seed.
struct Figures {
  std::vector<double> tumour_mm, craniotomy_mm, field_pct, coverage, rounds, time_ms;
};
using ByStage = std::array<Figures, 2>;

Result<pipeline::Pipeline> session_of(const bench::Head& head, const Guide& guide, int& rounds) {
  CaseConfig config = head.config;
  config.sensing.tumour = guide.tumour;
  config.sensing.probe_pose_sd_mm = config.sensing.probe_pose_sd_deg = guide.probe_pose_sd;
  config.inversion.sparse_points = guide.points;
  auto inverter = inversion::condensed_inverter(head.operators, head.locator, config);
  if (!inverter) return tl::unexpected(inverter.error());
  return pipeline::Pipeline::build(
      *head.model, config, Method::kCondensed, Boundary::kContact,
      std::make_unique<WatchedInverter>(std::move(*inverter), guide.cold, rounds));
}

// Two moments. Adds the figures of the second and returns its displacement fields.
Result<std::vector<Points>> play_boundary(const bench::Head& head,
                                          const client::SimulatedSurgery& surgery,
                                          const Guide& guide, const std::string& label,
                                          ByStage& figures) {
  int rounds = 0;
  auto session = session_of(head, guide, rounds);
  if (!session) return tl::unexpected(session.error());
  const std::size_t second = surgery.observations.size() / 2,
                    last = surgery.observations.size() - 1;
  std::vector<Points> fields;
  for (std::size_t i = 0; i <= last; ++i) {
    Observation observation = surgery.observations[i];
    if (i >= second) observation.acquired_ns += kLater_ns;
    const auto update = session->run(observation);
    if (!update) return tl::unexpected(update.error());
    if (i < second) continue;
    fields.push_back(update->estimate.displacement);
    if (i != second && i != last) continue;
    const auto run = score_update(head, surgery.truths[i], *update);
    if (!run) return tl::unexpected(run.error());
    const std::size_t stage = i == second ? 0 : 1;
    Figures& f = figures[stage];
    f.tumour_mm.push_back(run->error_mm.cross->mean);
    f.craniotomy_mm.push_back(run->error_mm.craniotomy_displacement->mean);
    f.field_pct.push_back(run->field_error_pct->p50);
    f.coverage.push_back(*run->coverage_90);
    f.rounds.push_back(rounds);
    f.time_ms.push_back(update->timings.register_ms + update->timings.invert_ms +
                        update->timings.rebuild_ms);
    std::printf("%s,%s,%s,%.3f,%.4f,%.4f,%.4f,%.2f,%.3f,%d,%d,%.1f\n", label.c_str(), guide.name,
                stage == 0 ? "tumour" : "all",
                surgery.truths[i].scalars.at("tumour_displacement_mm"), f.tumour_mm.back(),
                run->error_mm.craniotomy->mean, f.craniotomy_mm.back(), f.field_pct.back(),
                f.coverage.back(), rounds, update->estimate.contact.iterations, f.time_ms.back());
  }
  return fields;
}

void record_means(const std::string& study, const std::string& scenario, const Guide& guide,
                  const ByStage& figures) {
  for (std::size_t stage = 0; stage < 2; ++stage) {
    const Figures& f = figures[stage];
    if (f.tumour_mm.empty()) continue;  // a scenario of one source
    char text[200];
    std::snprintf(text, sizeof text,
                  "craniotomy %.3f mm; field %.1f %%; coverage %.2f; %.1f rounds; %.0f ms",
                  mean_std(f.craniotomy_mm).mean, mean_std(f.field_pct).mean,
                  mean_std(f.coverage).mean, mean_std(f.rounds).mean, percentile(f.time_ms, 50));
    const std::string name = scenario + ": " + (stage == 0 ? "tumour alone" : "all sources") +
                             "; " + guide.name + ": tumour error mm";
    test_support::record_figure(study, name, mean_std(f.tumour_mm).mean, text,
                                "twin; mean of 4 seeds");
    std::printf("mean %s %.3f %s\n", name.c_str(), mean_std(f.tumour_mm).mean, text);
  }
}

Status measure_boundary(const bench::Head& head, const std::string& study) {
  std::printf(
      "scenario,seed,guide,sources,initial mm,tumour mm,craniotomy mm,craniotomy vector mm,field "
      "%%,coverage,rounds,sets,ms\n");
  for (const char* name : kBoundaryScenarios) {
    std::vector<ByStage> figures(std::size(kGuides));
    double warm_cold_mm = 0.0;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      client::Scenario scenario = *client::find_scenario(name);
      scenario.stiffness_sd = kStiffnessSd;
      const double level = scenario.fluid_levels_mm.back();
      scenario.fluid_levels_mm = {level - kEarlier_mm, level};
      const auto surgery = client::play_scenario(*head.model, head.config, head.prepared->forward(),
                                                 scenario, static_cast<std::uint64_t>(seed));
      if (!surgery) return tl::unexpected(surgery.error());
      std::vector<std::vector<Points>> fields;
      for (std::size_t g = 0; g < std::size(kGuides); ++g) {
        auto played = play_boundary(head, *surgery, kGuides[g],
                                    std::string(name) + "," + std::to_string(seed), figures[g]);
        if (!played) return tl::unexpected(played.error());
        fields.push_back(std::move(*played));
      }
      for (std::size_t i = 0; i < fields[kWarm].size(); ++i) {
        const double apart = (fields[kWarm][i] - fields[kCold][i]).cwiseAbs().maxCoeff();
        std::printf("# %s %d update %zu warm - cold %.5f mm\n", name, seed, i, apart);
        warm_cold_mm = std::max(warm_cold_mm, apart);
      }
    }
    for (std::size_t g = 0; g < std::size(kGuides); ++g) {
      record_means(study, name, kGuides[g], figures[g]);
    }
    test_support::record_figure(study, std::string(name) + ": warm against cold mm", warm_cold_mm,
                                "shown", "greatest of all nodes and seeds");
    std::printf("mean %s warm against cold %.5f mm\n", name, warm_cold_mm);
    std::fflush(stdout);
  }
  return {};
}

}  // namespace

Status boundary_study(const bench::Head& head) { return measure_boundary(head, "boundary"); }

}  // namespace brainshift::sensing
