// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/pipeline/pipeline.hpp"

#include <iterator>
#include <utility>

#include "common/geometry/surface.hpp"
#include "common/pipeline/scene.hpp"

namespace brainshift::pipeline {
namespace {

void append(std::vector<Omission> omissions, Update& update) {
  update.left_out.insert(update.left_out.end(), std::make_move_iterator(omissions.begin()),
                         std::make_move_iterator(omissions.end()));
}

}  // namespace

Pipeline::Pipeline(const BrainModel& model, const CaseConfig& config, Method method,
                   Boundary boundary, std::unique_ptr<inversion::Inverter> inverter,
                   MakeInverter another, RegistrationTargets targets)
    : config_(config),
      targets_(std::move(targets)),
      evidence_(config_.sensing.max_age_s),
      inverter_(std::move(inverter)),
      another_(std::move(another)) {
  if (model.ventricle_wall.cols() > 0) ventricles_ = {model.mesh.nodes, model.ventricle_wall};
  blank_.case_id = model.case_id;
  blank_.model_id = model.model_id;
  blank_.method = method;
  blank_.boundary = boundary;
  blank_.left_out = model_omissions(model, config_, method, boundary);
}

Result<Pipeline> Pipeline::build(const BrainModel& model, const CaseConfig& config, Method method,
                                 Boundary boundary, std::unique_ptr<inversion::Inverter> inverter,
                                 MakeInverter another) {
  auto targets = RegistrationTargets::build(model);
  if (!targets) return tl::unexpected(targets.error());
  return Pipeline(model, config, method, boundary, std::move(inverter), std::move(another),
                  std::move(*targets));
}

void Pipeline::reset() {
  evidence_.clear();
  if (inverter_) inverter_->reset();
}

Result<Update> Pipeline::run(const Observation& observation, const RunOptions& options) {
  if (!inverter_) {
    auto made = another_();
    if (!made) return tl::unexpected(made.error());
    inverter_ = std::move(*made);
  }
  try {
    return answer(observation, options);
  } catch (...) {
    evidence_.drop(observation.source);
    if (another_) {
      inverter_.reset();
    } else {
      inverter_->reset();
    }
    throw;
  }
}

Result<Update> Pipeline::answer(const Observation& observation, const RunOptions& options) {
  Update update = blank_;
  update.observation_sequence = observation.sequence;

  const Stopwatch registering;  // Observation -> SparseData
  auto registered =
      register_observation(observation, targets_, config_, update.method, options.stop);
  if (!registered) return tl::unexpected(registered.error());
  if (registered->icp) {
    update.T_undeformed_deformed = registered->icp->T_surface_points;
    append(registration_omissions(*registered->icp, config_.scene.rotation,
                                  registered->surface.has_value()),
           update);
  }
  append(evidence_.put(std::move(*registered)), update);
  update.timings.register_ms = registering.milliseconds();

  const Stopwatch inverting;  // SparseData -> Estimate
  Estimate& estimate = update.estimate;
  if (auto status = estimate_into(observation, options, inverting, update); !status) {
    evidence_.drop(observation.source);
    return tl::unexpected(status.error());
  }
  if (ventricles_.num_triangles() > 0 &&
      estimate.displacement.cols() == ventricles_.num_vertices()) {
    estimate.ventricle_change_mm3 = geometry::growth_of_cavity(ventricles_, estimate.displacement);
  }
  if (estimate.quality.usable()) {
    evidence_.trust();
  } else {
    evidence_.quarantine(observation.source);
  }
  for (SourceSummary& summary : estimate.sources) {
    const RegisteredObservation* used = evidence_.newest(summary.source);
    if (used == nullptr) continue;
    summary.observation_sequence = used->sequence;
    summary.outliers += used->outliers;
    summary.age_s = 1e-9 * static_cast<double>(observation.acquired_ns - used->acquired_ns);
  }
  if (const auto errors = inverter_->omission_errors()) {
    append(inversion_omissions(config_, update.boundary, *errors, estimate.contact.active), update);
  }
  update.timings.rebuild_ms = estimate.rebuild_ms;
  update.timings.invert_ms = inverting.milliseconds() - update.timings.rebuild_ms;
  return update;
}

// The evidence's SparseData -> Estimate; once more without those that spoil it.
Status Pipeline::estimate_into(const Observation& observation, const RunOptions& options,
                               const Stopwatch& inverting, Update& update) {
  while (true) {
    const Stopwatch watch;
    const CombinedData combined(evidence_, observation.acquired_ns);
    inversion::InversionOptions asked;
    asked.stop = options.stop;
    asked.spent_ms = update.timings.register_ms + inverting.milliseconds();
    asked.moving = combined.moving();
    if (options.on_iterate) {
      asked.on_iterate = [&](const Estimate& iterate) {
        Update partial = update;  // its estimate is empty so far
        partial.final = false;
        partial.estimate = iterate;
        partial.timings.invert_ms = watch.milliseconds();
        options.on_iterate(std::move(partial));
      };
    }
    Status status = inverter_->update(combined.data(), asked, update.estimate);
    if ((status && update.estimate.quality.usable()) || options.stop.stop_requested())
      return status;
    auto dropped = evidence_.drop_quarantined(observation.source, observation.acquired_ns);
    if (dropped.empty()) return status;
    append(std::move(dropped), update);
  }
}

}  // namespace brainshift::pipeline
