// SPDX-License-Identifier: GPL-3.0-or-later
// The scene: which parts of the work a session carries, from the case, the method and the boundary,
// and what an update leaves out of the physics, why, and how much that costs.
//
// What depends on an observation is decided with it: contact (carried when a slave would penetrate)
// and rotation (about the axes that the points show). Every Update lists what is left out.
#pragma once

#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/inversion/contract/inversion_options.hpp"
#include "common/registration/icp.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::registration {
struct IcpResult;
}

namespace brainshift::pipeline {

struct ScenePlan {
  bool pressure = false;
  bool contact = true;  // searched for; an update without any leaves it out by itself
  bool uncertainty = true, gravity_modes = true, far_field = true;
};

// kInvalidArgument for a part that is forced on but not available (scene.pressure with method pcg;
// scene.contact under the fixed boundary; scene.uncertainty with a method without covariance;
// scene.gravity_modes without modes in the prior), and for a part that is forced off but that the
// method always carries. The sentence names the key.
Result<ScenePlan> plan_scene(const CaseConfig& config, Method method, Boundary boundary);

// The nodes where an answer is wanted when the far field is left out: inside the tumour or within
// margin_mm of its surface; sorted. Empty without a usable surface.
std::vector<NodeIndex> region_of_interest(const BrainModel& model, double margin_mm);

// ---------- what is left out ----------

// Time after which pore pressure has drained: R^2 / c_v with c_v = k / (S + alpha^2 / (lambda + 2
// G)), Biot's theory in one dimension. R: radius of the ball with the mesh's volume. Seconds.
double consolidation_time_s(const TetMesh& mesh, const Material& material);

// Upper bound of the part of a load's final displacement that is still missing `seconds` after it
// was applied: exp(-(pi^2/4) t/T), T the consolidation time. Terzaghi's series for a layer of
// thickness R that drains on one side, 8/pi^2 sum exp(-(2m+1)^2 (pi^2/4) t/T) / (2m+1)^2, with
// every exponential replaced by the first.
double undrained_fraction(double seconds, double consolidation_time_s);

// The same for one backward-Euler step of that length from rest, which scene.pressure = on takes:
// 1 / (1 + (pi^2/4) t/T), above the other for every t.
double implicit_step_fraction(double seconds, double consolidation_time_s);

// Parts of the prior that the case switches off, each with what it moves where it acts: median of
// the motion under the default prior, at the cortex and at the tumour (docs/decisions/0018).
std::vector<Omission> prior_omissions(const PriorConfig& prior);

// Fixed by case, method and boundary: pressure, uncertainty, contact under the fixed boundary, and
// parts of the prior.
std::vector<Omission> model_omissions(const BrainModel& model, const CaseConfig& config,
                                      Method method, Boundary boundary);

// What one inversion left out: contact (forced off, or no slave touched), gravity modes, far field.
std::vector<Omission> inversion_omissions(const CaseConfig& config, Boundary boundary,
                                          const inversion::OmissionErrors& errors,
                                          int active_slaves);

// What the alignment of one observation did not estimate: rotation (switched off, or not
// observable). start_only: the alignment is where distances start and says nothing else; the
// inversion estimates what they show of a rotation. It is named too when it did not converge.
std::vector<Omission> registration_omissions(const registration::IcpResult& icp, Carry rotation,
                                             bool start_only);

}  // namespace brainshift::pipeline
