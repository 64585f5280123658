// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/surgery_place.hpp"

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "client/tools/twin/surgery.hpp"
#include "common/contact/forward_model.hpp"
#include "common/core/stopwatch.hpp"
#include "common/inversion/inverter.hpp"
#include "common/pipeline/pipeline.hpp"
#include "tests/simulation/variation.hpp"
#include "tests/surgeries/outside/outside_truth.hpp"
#include "tests/surgeries/played_brain.hpp"

namespace brainshift::surgeries {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// The brains of one seed. They differ by the resection alone: every variation has the same
// stiffness.
class PlayedBrains {
 public:
  PlayedBrains(const bench::Head& head, std::uint64_t seed) : head_(head), seed_(seed) {}

  Result<PlayedBrain*> of(const client::Scenario& scenario) {
    auto& place = brains_[scenario.resection.has_value()];
    if (place) return place.get();
    auto brain = client::truth_brain(*head_.model, head_.config, scenario, seed_);
    if (!brain) return tl::unexpected(brain.error());
    auto made = factorised(std::move(*brain));
    if (!made) return tl::unexpected(made.error());
    place = std::move(*made);
    return place.get();
  }

 private:
  const bench::Head& head_;
  std::uint64_t seed_;
  std::map<bool, std::unique_ptr<PlayedBrain>> brains_;
};

// An inverter that sleeps through updates: until it is woken, the brain has not moved. A pipeline
// over it gathers evidence as any other does, so that the update that wakes it is the estimate of
// all evidence by an inverter that starts cold.
class SleepingInverter final : public inversion::Inverter {
 public:
  // awake: read at every update; must outlive this object. nodes: of the mesh.
  SleepingInverter(std::unique_ptr<inversion::Inverter> inverter, const bool& awake, int nodes)
      : inverter_(std::move(inverter)), awake_(awake), nodes_(nodes) {}

  void reset() override { inverter_->reset(); }
  std::optional<inversion::OmissionErrors> omission_errors() const override {
    if (awake_) return inverter_->omission_errors();
    return std::nullopt;
  }
  std::uint64_t bytes() const override { return inverter_->bytes(); }

 private:
  Status invert(const SparseData& data, const inversion::InversionOptions& options,
                Estimate& estimate) override {
    if (awake_) return inverter_->update(data, options, estimate);
    estimate = Estimate{};
    estimate.displacement = Points::Zero(3, nodes_);
    return {};
  }

  std::unique_ptr<inversion::Inverter> inverter_;
  const bool& awake_;
  int nodes_;
};

// The pipeline of the daemon's default session, and one that starts cold at the last update.
class Sessions {
 public:
  static Result<std::unique_ptr<Sessions>> begin(const bench::Head& head) {
    auto sessions = std::unique_ptr<Sessions>(new Sessions);
    auto warm = build(head, inverter(head));
    if (!warm) return tl::unexpected(warm.error());
    auto sleeper = inverter(head);
    if (!sleeper) return tl::unexpected(sleeper.error());
    auto cold =
        build(head, std::make_unique<SleepingInverter>(std::move(*sleeper), sessions->awake_,
                                                       head.model->mesh.num_nodes()));
    if (!cold) return tl::unexpected(cold.error());
    sessions->warm_ = std::make_unique<pipeline::Pipeline>(std::move(*warm));
    sessions->cold_ = std::make_unique<pipeline::Pipeline>(std::move(*cold));
    return sessions;
  }

  void reset() {
    warm_->reset();
    cold_->reset();
  }
  Result<Update> run(const Observation& observation) { return warm_->run(observation); }

  // Largest distance of a node between the estimates of all observations, one after the last
  // update, the other cold. A surgery of one observation is measured a second time for the first.
  // NaN when an update is refused.
  double warm_against_cold(const std::vector<Observation>& observations, const Points& last) {
    Points warm = last;
    if (observations.size() == 1) {
      Observation again = observations.front();
      ++again.sequence;
      const auto update = run(again);
      if (!update) return kNaN;
      warm = update->estimate.displacement;
    }
    cold_->reset();
    double distance = kNaN;
    for (std::size_t i = 0; i < observations.size(); ++i) {
      awake_ = i + 1 == observations.size();
      const auto update = cold_->run(observations[i]);
      if (!update) return kNaN;
      if (awake_) distance = (update->estimate.displacement - warm).colwise().norm().maxCoeff();
    }
    return distance;
  }

 private:
  Sessions() = default;
  static Result<std::unique_ptr<inversion::Inverter>> inverter(const bench::Head& head) {
    return inversion::condensed_inverter(head.operators, head.locator, head.config);
  }
  static Result<pipeline::Pipeline> build(const bench::Head& head,
                                          Result<std::unique_ptr<inversion::Inverter>> inverter) {
    if (!inverter) return tl::unexpected(inverter.error());
    return pipeline::Pipeline::build(*head.model, head.config, Method::kCondensed,
                                     Boundary::kContact, std::move(*inverter));
  }

  bool awake_ = false;
  std::unique_ptr<pipeline::Pipeline> warm_, cold_;
};

Result<std::vector<Row>> play(const bench::Head& head, const SurgeryFacts& facts,
                              const client::Scenario& scenario,
                              const Result<client::SimulatedSurgery>& surgery, Sessions& sessions) {
  if (!surgery && surgery.error().code == ErrorCode::kInvalidArgument) {
    return std::vector<Row>{
        refused_row(facts, 0, surgery.error().message)};  // it does nothing here
  }
  if (!surgery) return tl::unexpected(surgery.error());
  sessions.reset();
  const auto& observations = surgery->observations;
  std::vector<Row> rows;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const int stage = static_cast<int>(i);
    const auto update = sessions.run(observations[i]);
    if (!update) {
      rows.push_back(refused_row(facts, stage, update.error().message));
      continue;
    }
    const auto score = score_update(*head.model, surgery->truths[i], update->estimate, stage);
    if (!score) return tl::unexpected(score.error());
    const bool last = i + 1 == observations.size();
    const double warm_cold =
        last ? sessions.warm_against_cold(observations, update->estimate.displacement) : kNaN;
    rows.push_back(row_of(facts, scenario, surgery->truths[i], stage, *update, *score, warm_cold));
  }
  return rows;
}

// What the instruments of kSeenBy see of a truth from outside.
Result<client::SimulatedSurgery> play_outside(const bench::Head& head,
                                              outside::OutsideTruths& truths,
                                              const outside::Kind& kind, std::uint64_t seed) {
  auto truth = truths.make(kind, seed);
  if (!truth) {
    if (truth.error().code != ErrorCode::kNotConverged) return tl::unexpected(truth.error());
    return invalid(truth.error().message);  // a row, as of a scenario that does nothing
  }
  client::Scenario scenario = *client::find_scenario(kSeenBy);
  if (truth->resected_fraction) scenario.resection = client::Resection{*truth->resected_fraction};
  auto surgery =
      client::play_given(*head.model, head.config, scenario, std::move(truth->displacement), seed);
  if (!surgery) return surgery;
  for (io::SurgeryTruth& each : surgery->truths) {
    each.scalars["outside"] = 1.0;
    each.scalars["load_scale"] = truth->load_scale;
    each.scalars["volume_loss"] = truth->volume_loss;
    each.scalars["max_displacement_mm"] = truth->largest_mm;
  }
  return surgery;
}

}  // namespace

Status play_place(const bench::Head& head, const PlacePlan& plan, RowFile& rows, const Told& told) {
  auto sessions = Sessions::begin(head);
  if (!sessions) return tl::unexpected(sessions.error());
  SurgeryFacts facts;
  facts.patient_seed = plan.patient_seed;
  facts.nodes = head.model->mesh.num_nodes();
  facts.slaves = static_cast<int>(head.model->slaves.size());
  facts.full_solve_ms = contact::measure_full_solve_ms(head.prepared->forward());
  const auto finish = [&](const client::Scenario& scenario,
                          const Result<client::SimulatedSurgery>& surgery,
                          const Stopwatch& watch) -> Status {
    const std::string& name = facts.key.scenario;
    const auto played = play(head, facts, scenario, surgery, **sessions);
    if (!played) return fail(played.error().code, name + ": " + played.error().message);
    if (Status ok = rows.append(*played); !ok) return ok;
    if (told) told(facts.key, played->back(), watch.seconds());
    return {};
  };
  std::unique_ptr<outside::OutsideTruths> truths;
  for (const std::uint64_t seed : plan.seeds) {
    PlayedBrains brains(head, seed);
    for (const std::string& name : plan.scenarios) {
      facts.key = {plan.head, plan.place, seed, name};
      if (rows.has(facts.key.texts())) continue;
      const Stopwatch watch;
      const client::Scenario scenario = client::vary(*client::find_scenario(name), seed);
      const auto brain = brains.of(scenario);
      if (!brain) return fail(brain.error().code, name + ": " + brain.error().message);
      const auto surgery = client::play_scenario((*brain)->brain, (*brain)->solver, scenario, seed);
      if (Status ok = finish(scenario, surgery, watch); !ok) return ok;
    }
    for (const std::string& name : plan.kinds) {
      facts.key = {plan.head, plan.place, seed, name};
      if (rows.has(facts.key.texts())) continue;
      const Stopwatch watch;
      if (!truths) {
        auto made = outside::OutsideTruths::make(*head.model, head.config);
        if (!made) return tl::unexpected(made.error());
        truths = std::move(*made);
      }
      const auto surgery = play_outside(head, *truths, *outside::find_kind(name), seed);
      if (Status ok = finish(client::Scenario{}, surgery, watch); !ok) return ok;
    }
  }
  return {};
}

}  // namespace brainshift::surgeries
