// SPDX-License-Identifier: GPL-3.0-or-later
// First stage: Observation -> SparseData.
//
//   TumourBoundary   ICP to the undeformed tumour surface (paper 2.7), from the tracked pose; then a random
//                    subset of inversion.sparse_points boundary points (paper 2.6), always the same one for
//                    the same number of points. scene.rotation = off: translation only; on: about every axis,
//                    however little the points show of it
//   LandmarkPairs    displacement = deformed - undeformed, all pairs
//   CorticalSurface, PatientPose   refused: not assimilated in this version
//
// Every datum gets the standard deviation inversion.sigma_mm, the sigma_eps of the paper's W_eps, whatever
// the observation says of itself. Assumption: independent errors, see SparseData.
#pragma once

#include <optional>

#include "common/core/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/observation.hpp"
#include "common/core/sparse_data.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/registration/icp.hpp"

namespace brainshift::server {

struct RegisteredObservation {
  SparseData data;
  std::optional<registration::IcpResult> icp;  // when the observation had to be aligned
};

// kInvalidArgument: a body that is not assimilated, landmark counts that differ, fewer than 3 points;
// kNotFinite: NaN or infinity. The sentence names the observation's source and the count.
Result<RegisteredObservation> register_observation(const Observation& observation,
                                                   const geometry::ClosestPointIndex& tumour,
                                                   const CaseConfig& config);

}  // namespace brainshift::server
