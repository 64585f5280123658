// SPDX-License-Identifier: GPL-3.0-or-later
// ScenePlan: which parts of the work a session carries, from the case, the method and the boundary.
//
// What depends on an observation is decided with it: contact (carried when a slave would penetrate)
// and rotation (about the axes that the points show). Every Update lists what is left out,
// common/pipeline/left_out.hpp.
#pragma once

#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::pipeline {

struct ScenePlan {
  bool pressure = false;
  bool contact = true;  // searched for; an update without any leaves it out by itself
  bool uncertainty = true;
  bool gravity_modes = true;
  bool far_field = true;
};

// kInvalidArgument for a part that is forced on but not available (scene.pressure with method pcg;
// scene.contact under the fixed boundary; scene.uncertainty with a method without covariance;
// scene.gravity_modes without modes in the prior), and for a part that is forced off but that the
// method always carries. The sentence names the key.
Result<ScenePlan> plan_scene(const CaseConfig& config, Method method, Boundary boundary);

// The nodes where an answer is wanted when the far field is left out: inside the tumour or within
// margin_mm of its surface; sorted. Empty without a usable surface.
std::vector<NodeIndex> region_of_interest(const BrainModel& model, double margin_mm);

}  // namespace brainshift::pipeline
