// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/pipeline/pipeline.hpp"

#include <iterator>
#include <utility>

#include "common/core/stopwatch.hpp"
#include "common/pipeline/left_out.hpp"

namespace brainshift::pipeline {
namespace {

void append(std::vector<Omission> omissions, Update& update) {
  update.left_out.insert(update.left_out.end(), std::make_move_iterator(omissions.begin()),
                         std::make_move_iterator(omissions.end()));
}

}  // namespace

Pipeline::Pipeline(std::shared_ptr<const BrainModel> model, const CaseConfig& config, Method method,
                   Boundary boundary, std::unique_ptr<inversion::Inverter> inverter,
                   RegistrationTargets targets)
    : model_(std::move(model)),
      config_(config),
      method_(method),
      boundary_(boundary),
      targets_(std::move(targets)),
      model_omissions_(model_omissions(*model_, config_, method_, boundary_)),
      evidence_(config_.sensing.max_age_s),
      inverter_(std::move(inverter)) {}

Result<Pipeline> Pipeline::build(std::shared_ptr<const BrainModel> model, const CaseConfig& config,
                                 Method method, Boundary boundary,
                                 std::unique_ptr<inversion::Inverter> inverter) {
  auto targets = RegistrationTargets::build(*model);
  if (!targets) return tl::unexpected(targets.error());
  return Pipeline(std::move(model), config, method, boundary, std::move(inverter),
                  std::move(*targets));
}

void Pipeline::reset() {
  evidence_.clear();
  inverter_->reset();
}

Result<Update> Pipeline::run(const Observation& observation, const RunOptions& options) {
  Update update;
  update.case_id = model_->case_id;
  update.model_id = model_->model_id;
  update.observation_sequence = observation.sequence;
  update.method = method_;
  update.boundary = boundary_;
  update.left_out = model_omissions_;
  if (auto status = register_into(observation, update); !status) {
    return tl::unexpected(status.error());
  }
  const Stopwatch watch;
  const Estimate& estimate = update.estimate;
  Status status = estimate_into(observation, options, update);
  if ((!status || !estimate.quality.usable()) && !options.stop.stop_requested()) {
    auto dropped = evidence_.drop_quarantined(observation.source, observation.acquired_ns);
    if (!dropped.empty()) {  // once more without those that spoil it
      append(std::move(dropped), update);
      status = estimate_into(observation, options, update);
    }
  }
  if (!status) {
    evidence_.drop(observation.source);
    return tl::unexpected(status.error());
  }
  if (estimate.quality.usable()) {
    evidence_.trust();
  } else {
    evidence_.quarantine(observation.source);
  }
  if (const auto errors = inverter_->omission_errors()) {
    append(inversion_omissions(config_, boundary_, *errors, estimate.contact.active), update);
  }
  update.timings.rebuild_ms = estimate.rebuild_ms;
  update.timings.invert_ms = watch.milliseconds() - update.timings.rebuild_ms;
  return update;
}

// Observation -> SparseData, into the evidence.
Status Pipeline::register_into(const Observation& observation, Update& update) {
  const Stopwatch watch;
  auto registered = register_observation(observation, targets_, config_, method_);
  if (!registered) return tl::unexpected(registered.error());
  if (registered->icp) {
    update.T_undeformed_deformed = registered->icp->T_surface_points;
    append(registration_omissions(*registered->icp, config_.scene.rotation,
                                  registration::IcpOptions{}.rotation_sd_deg,
                                  registered->surface.has_value()),
           update);
  }
  append(evidence_.put(std::move(*registered)), update);
  update.timings.register_ms = watch.milliseconds();
  return {};
}

// The evidence's SparseData -> Estimate.
Status Pipeline::estimate_into(const Observation& observation, const RunOptions& options,
                               Update& update) {
  const Stopwatch watch;
  const CombinedData combined(evidence_.fresh(observation.acquired_ns));
  inversion::InversionOptions asked;
  asked.stop = options.stop;
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
  Estimate& estimate = update.estimate;
  if (auto status = inverter_->update(combined.data(), asked, estimate); !status) return status;
  combined.describe(observation.acquired_ns, estimate.sources);
  return {};
}

}  // namespace brainshift::pipeline
