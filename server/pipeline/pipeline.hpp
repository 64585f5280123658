// SPDX-License-Identifier: GPL-3.0-or-later
// Pipeline: Observation -> register -> SparseData -> invert -> Estimate -> Update.
//
// Values in, values out; it knows no socket, no log and no wire format, and it keeps nothing between
// observations: what earlier ones said is in the Evidence that the caller keeps. The inversion is given as a function,
// so that rules can be tested without a factorisation.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <stop_token>
#include <vector>

#include "common/values/brain_model.hpp"
#include "common/values/case_config.hpp"
#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/values/observation.hpp"
#include "common/values/sparse_data.hpp"
#include "common/inversion/invert.hpp"
#include "server/pipeline/evidence.hpp"

namespace brainshift::server {

using InvertFunction =
    std::function<Result<Estimate>(const SparseData&, const inversion::InversionOptions&)>;

// What the last inversion left out; called after each one that succeeded.
using OmissionFunction = std::function<std::vector<Omission>(const Estimate&)>;

struct RunOptions {
  Method method = Method::kPaper;
  // Called on the running thread with each iterate (final == false); may be empty.
  std::function<void(const Update&)> on_iterate;
  std::stop_token stop;
};

class Pipeline {
 public:
  // Indexes the surfaces; kEmptySet / kNotFinite when the model has no usable one.
  static Result<Pipeline> build(std::shared_ptr<const BrainModel> model, const CaseConfig& config,
                                Boundary boundary, InvertFunction invert,
                                OmissionFunction omissions = {});

  // Fills everything of an Update except its sequence number and the encode and journal times, which
  // belong to later stages. Errors of registration and inversion pass through unchanged.
  // `evidence` takes the observation in, and gives the other sources' that are fresh enough to be used beside it; an
  // observation without an estimate is dropped from it.
  Result<Update> run(const Observation& observation, const RunOptions& options,
                     Evidence& evidence) const;
  // One observation by itself.
  Result<Update> run(const Observation& observation, const RunOptions& options) const;

 private:
  Pipeline(std::shared_ptr<const BrainModel> model, const CaseConfig& config, Boundary boundary,
           InvertFunction invert, OmissionFunction omissions, RegistrationTargets targets);
  Result<Update> estimate(const Observation& observation, const RunOptions& options,
                          Evidence& evidence, Update update) const;

  std::shared_ptr<const BrainModel> model_;
  CaseConfig config_;
  Boundary boundary_;
  InvertFunction invert_;
  OmissionFunction omissions_;
  RegistrationTargets targets_;
  std::map<Method, std::vector<Omission>> model_omissions_;  // the same for every update
};

}  // namespace brainshift::server
