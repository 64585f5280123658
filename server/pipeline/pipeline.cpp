// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/pipeline/pipeline.hpp"

#include <chrono>
#include <utility>

#include "server/pipeline/left_out.hpp"
#include "server/pipeline/registration_stage.hpp"

namespace brainshift::server {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

}  // namespace

Pipeline::Pipeline(std::shared_ptr<const BrainModel> model, const CaseConfig& config,
                   Boundary boundary, InvertFunction invert, OmissionFunction omissions,
                   RegistrationTargets targets)
    : model_(std::move(model)),
      config_(config),
      boundary_(boundary),
      invert_(std::move(invert)),
      omissions_(std::move(omissions)),
      targets_(std::move(targets)) {
  for (const Method method : kAllMethods) {
    model_omissions_.emplace(method, model_omissions(*model_, config_, method, boundary_));
  }
}

Result<Pipeline> Pipeline::build(std::shared_ptr<const BrainModel> model, const CaseConfig& config,
                                 Boundary boundary, InvertFunction invert,
                                 OmissionFunction omissions) {
  auto targets = RegistrationTargets::build(*model);
  if (!targets) return tl::unexpected(targets.error());
  return Pipeline(std::move(model), config, boundary, std::move(invert), std::move(omissions),
                  std::move(*targets));
}

Result<Update> Pipeline::run(const Observation& observation, const RunOptions& options) const {
  Evidence alone(config_.sensing.max_age_s);
  return run(observation, options, alone);
}

Result<Update> Pipeline::run(const Observation& observation, const RunOptions& options,
                             Evidence& evidence) const {
  const auto start = Clock::now();
  auto registered = register_observation(observation, targets_, config_, options.method);
  if (!registered) return tl::unexpected(registered.error());

  Update update;
  update.case_id = model_->case_id;
  update.model_id = model_->model_id;
  update.observation_sequence = observation.sequence;
  update.method = options.method;
  update.boundary = boundary_;
  update.left_out = model_omissions_.at(options.method);
  if (registered->icp) {
    update.T_undeformed_deformed = registered->icp->T_surface_points;
    for (auto& omission : registration_omissions(*registered->icp, config_.scene.rotation,
                                                 registration::IcpOptions{}.rotation_sd_deg)) {
      update.left_out.push_back(std::move(omission));
    }
  }
  evidence.put(std::move(*registered));
  for (auto& omission : evidence.stale(observation.acquired_ns)) {
    update.left_out.push_back(std::move(omission));
  }
  update.timings.register_ms = milliseconds_since(start);
  auto result = estimate(observation, options, evidence, std::move(update));
  if (!result) evidence.drop(observation.source);
  return result;
}

Result<Update> Pipeline::estimate(const Observation& observation, const RunOptions& options,
                                  Evidence& evidence, Update update) const {
  const auto start = Clock::now();
  const CombinedData combined(evidence.fresh(observation.acquired_ns), evidence);
  inversion::InversionOptions inversion_options;
  inversion_options.method = options.method;
  inversion_options.stop = options.stop;
  inversion_options.moving = combined.moving();
  if (options.on_iterate) {
    inversion_options.on_iterate = [&](const Estimate& iterate) {
      update.final = false;
      update.estimate = iterate;
      update.timings.invert_ms = milliseconds_since(start);
      options.on_iterate(update);
    };
  }
  auto inverted = invert_(combined.data(), inversion_options);
  if (!inverted) return tl::unexpected(inverted.error());
  update.final = true;
  update.estimate = std::move(*inverted);
  combined.describe(observation.acquired_ns, update.estimate.sources);
  evidence.remember(update.estimate.displacement);
  if (omissions_) {
    for (auto& omission : omissions_(update.estimate)) {
      update.left_out.push_back(std::move(omission));
    }
  }
  update.timings.rebuild_ms = update.estimate.rebuild_ms;
  update.timings.invert_ms = milliseconds_since(start) - update.timings.rebuild_ms;
  return update;
}

}  // namespace brainshift::server
