// SPDX-License-Identifier: GPL-3.0-or-later
// What an update leaves out of the physics, why, and how much that costs.
#pragma once

#include <optional>
#include <vector>

#include "common/core/brain_model.hpp"
#include "common/core/case_config.hpp"
#include "common/core/estimate.hpp"
#include "common/registration/icp.hpp"

namespace brainshift::server {

// Time after which pore pressure has drained: R^2 / c_v with c_v = k (lambda + 2 G), Biot's theory in one
// dimension; R is the radius of the ball with the mesh's volume, k = 1e-7 m^3 s/kg (Table 1). Seconds.
double consolidation_time_s(const TetMesh& mesh, const Material& material);

// Fixed by case, method and boundary: pressure, uncertainty, and contact under the fixed boundary.
std::vector<Omission> model_omissions(const BrainModel& model, const CaseConfig& config,
                                      Method method, Boundary boundary);

// What the alignment of one observation could not see: unobservable rotation, no convergence.
std::vector<Omission> registration_omissions(const registration::IcpResult& icp,
                                             double rotation_prior_sd_deg);

}  // namespace brainshift::server
