// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/pipeline/scene_plan.hpp"

#include <fmt/format.h>

#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::pipeline {
namespace {

tl::unexpected<Error> refused(const char* part, const char* value, const std::string& reason) {
  return fail(ErrorCode::kInvalidArgument, fmt::format("scene.{} = {}: {}", part, value, reason));
}

}  // namespace

Result<ScenePlan> plan_scene(const CaseConfig& config, Method method, Boundary boundary) {
  const SceneConfig& scene = config.scene;
  const std::string name(to_string(method));
  const bool condensed = method == Method::kCondensed;
  const bool has_modes =
      config.prior.gravity_mode_sd > 0.0 && !config.prior.gravity_levels_mm.empty();
  if (scene.pressure == Carry::kOn && method == Method::kIterativeSolver) {
    return refused("pressure", "on", "method " + name + " has no solver for pore pressure");
  }
  if (scene.contact == Carry::kOn && boundary == Boundary::kFixed) {
    return refused("contact", "on", "the fixed boundary has no contact");
  }
  if (scene.uncertainty == Carry::kOn && !condensed) {
    return refused("uncertainty", "on", "method " + name + " computes no standard deviation");
  }
  if (scene.gravity_modes == Carry::kOn && !has_modes) {
    return refused("gravity_modes", "on",
                   "prior.gravity_mode_sd and prior.gravity_levels_mm leave none");
  }
  if (scene.contact == Carry::kOff && !condensed && boundary == Boundary::kContact) {
    return refused("contact", "off", "method " + name + " always carries contact");
  }
  if (scene.gravity_modes == Carry::kOff && !condensed && has_modes) {
    return refused("gravity_modes", "off",
                   "method " + name + " always carries them; set prior.gravity_mode_sd to 0");
  }
  ScenePlan plan;
  plan.pressure = scene.pressure == Carry::kOn;
  plan.contact = boundary == Boundary::kContact && scene.contact != Carry::kOff;
  plan.uncertainty = condensed && scene.uncertainty != Carry::kOff;
  plan.gravity_modes = has_modes && scene.gravity_modes != Carry::kOff;
  plan.far_field = !condensed || scene.far_field != Carry::kOff;
  return plan;
}

std::vector<NodeIndex> region_of_interest(const BrainModel& model, double margin_mm) {
  std::vector<NodeIndex> region;
  const auto tumour = geometry::ClosestPointIndex::build(model.tumour);
  if (!tumour) return region;
  for (int i = 0; i < model.mesh.num_nodes(); ++i) {
    const Vec3 node = model.mesh.nodes.col(i);
    const geometry::ClosestPoint closest = tumour->closest(node);
    const bool inside = tumour->triangle_normal(closest.triangle).dot(node - closest.point) <= 0.0;
    if (inside || closest.distance_mm <= margin_mm) region.push_back(i);
  }
  return region;
}

}  // namespace brainshift::pipeline
