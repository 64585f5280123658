// SPDX-License-Identifier: GPL-3.0-or-later
// Small values that the server's tests share.
#pragma once

#include <cstdint>
#include <string>

#include "common/values/estimate.hpp"
#include "common/values/observation.hpp"

namespace brainshift::server {

inline constexpr const char* kCase = "test-case";

// Four landmark pairs, each moved by 1 mm along x.
inline Observation landmarks(std::uint64_t sequence, const std::string& source = "pointer") {
  LandmarkPairs pairs;
  pairs.undeformed.resize(3, 4);
  pairs.undeformed << 0, 10, 0, 0,  //
      0, 0, 10, 0,                  //
      0, 0, 0, 10;
  pairs.deformed = pairs.undeformed.colwise() + Vec3(1, 0, 0);
  pairs.sd_mm = 0.3;
  Observation observation;
  observation.case_id = kCase;
  observation.source = source;
  observation.sequence = sequence;
  observation.body = pairs;
  return observation;
}

// What a pipeline would answer; every node moves by the observation's sequence number along x.
inline Update answer(const Observation& observation, int nodes = 5) {
  Update update;
  update.case_id = observation.case_id;
  update.model_id = "0123456789abcdef";
  update.observation_sequence = observation.sequence;
  update.estimate.status = EstimateStatus::kConverged;
  update.estimate.reason = "test";
  update.estimate.displacement = Points::Zero(3, nodes);
  update.estimate.displacement.row(0).setConstant(static_cast<double>(observation.sequence));
  return update;
}

}  // namespace brainshift::server
