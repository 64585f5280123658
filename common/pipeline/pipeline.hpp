// SPDX-License-Identifier: GPL-3.0-or-later
// Pipeline: Observation -> register -> SparseData -> invert -> Estimate -> Update, for one patient,
// one method and one boundary condition.
//
//   fixed at build    patient, case, method, boundary, surfaces to register to, omissions of the
//                     scene
//   state             evidence (the newest observation of every source) and what the inverter
//                     reuses; reset() forgets both
// It knows no socket, no log and no wire format. Not thread-safe: a session's worker owns it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/stopwatch.hpp"
#include "common/inversion/inverter.hpp"
#include "common/pipeline/evidence.hpp"
#include "common/pipeline/registration_stage.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"
#include "common/values/observation.hpp"

namespace brainshift::pipeline {

// Of one observation.
struct RunOptions {
  // Called on the running thread with each iterate (final == false); may be empty.
  std::function<void(Update)> on_iterate;
  std::stop_token stop;
};

using MakeInverter = std::function<Result<std::unique_ptr<inversion::Inverter>>()>;

class Pipeline {
 public:
  // Indexes the surfaces; kEmptySet or kNotFinite when the model has no usable one. inverter: for
  // this method and boundary. another: makes one more; empty: an inverter that threw is reset.
  static Result<Pipeline> build(const BrainModel& model, const CaseConfig& config, Method method,
                                Boundary boundary, std::unique_ptr<inversion::Inverter> inverter,
                                MakeInverter another = {});

  // Fills everything of an Update except its sequence number and the encode and journal times,
  // which belong to later stages. The inverter writes into the update's own estimate. Errors of
  // registration and inversion pass through unchanged; such an observation is not used again. One
  // without a usable estimate (values/quality.hpp) is tried once more beside the next
  // (evidence.hpp), and no later update starts from an unusable field.
  // An exception (memory that is not to be had) passes through too. It costs this observation and
  // the inverter, which may be half changed: the next call makes another, or returns its error.
  // Precondition: the observation's numbers are finite (wire::decode_observation).
  Result<Update> run(const Observation& observation, const RunOptions& options = {});

  // What the last update left unknown (inversion::Inverter::posterior).
  std::optional<inversion::PosteriorModes> posterior() const {
    return inverter_ ? inverter_->posterior() : std::nullopt;
  }
  const RegistrationTargets& targets() const { return targets_; }

  // A session begins: forgets what earlier ones observed and estimated.
  void reset();

 private:
  Pipeline(const BrainModel& model, const CaseConfig& config, Method method, Boundary boundary,
           std::unique_ptr<inversion::Inverter> inverter, MakeInverter another,
           RegistrationTargets targets);
  Result<Update> answer(const Observation& observation, const RunOptions& options);
  Status estimate_into(const Observation& observation, const RunOptions& options,
                       const Stopwatch& inverting, Update& update);

  CaseConfig config_;
  RegistrationTargets targets_;
  TriangleSurface ventricles_;  // their wall, with all nodes of the mesh; empty without
  Update blank_;  // what is the same in every update: names, method, boundary, omissions

  Evidence evidence_;
  std::unique_ptr<inversion::Inverter> inverter_;  // null: it threw
  MakeInverter another_;
};

}  // namespace brainshift::pipeline
