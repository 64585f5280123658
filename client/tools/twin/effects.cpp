// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/tools/twin/truth_load.hpp"
#include "common/contact/penalty.hpp"
#include "common/fem/body_loads.hpp"

namespace brainshift::client {
namespace {

double angle_deg(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

Status nothing(const Scenario& scenario, const std::string& ingredient, const std::string& why) {
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("adverse ingredient {} does nothing in scenario {} on this case: {}",
                          ingredient, scenario.name, why));
}

// Weights of the whole brain, by the case's own mesh.
Points weights(const TruthBrain& brain, const Scenario& scenario, double level_mm) {
  const Gravity gravity = gravity_of(brain.model, scenario);
  return fem::buoyancy_load(brain.tissue, brain.config.material, gravity.direction,
                            gravity.fluid_plane_depth_mm + level_mm, gravity.direction);
}

bool same(const Points& a, const Points& b) {
  return (a - b).cwiseAbs().maxCoeff() <=
         1e-9 * std::max(a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff());
}

}  // namespace

Status check_gravity(const TruthBrain& brain, const Scenario& scenario) {
  if (scenario.gravity_tilt_deg != 0.0) {
    const double turned = angle_deg(tilted_gravity(brain.model, scenario.gravity_tilt_deg),
                                    brain.model.gravity_direction);
    if (turned < kLeastTilt_deg) {
      return fail(ErrorCode::kInvalidArgument,
                  fmt::format("scenario {} does nothing on this case: gravity lies along the axis "
                              "from the tumour to the craniotomy, so that {:g} degrees about it "
                              "turn gravity by {:.1f}",
                              scenario.name, scenario.gravity_tilt_deg, turned));
    }
  }
  const Adversity& adverse = scenario.adverse;
  const double level = scenario.fluid_levels_mm.front();
  if (adverse.level_error_mm != 0.0 &&
      same(weights(brain, scenario, level),
           weights(brain, scenario, level + adverse.level_error_mm))) {
    return nothing(scenario, "level", "no tissue lies between the two levels");
  }
  if (!adverse.gravity_error_deg.isZero(0.0)) {
    Scenario straight = scenario;
    straight.adverse.gravity_error_deg.setZero();
    const double lower = level + adverse.level_error_mm;
    if (same(weights(brain, scenario, lower), weights(brain, straight, lower))) {
      return nothing(scenario, "gravity", "no tissue is out of the fluid");
    }
  }
  return {};
}

Status check_retraction(const TruthBrain& brain, const Scenario& scenario) {
  if (!scenario.retraction) return {};
  const BrainModel& body = brain.elsewhere ? brain.elsewhere->model : brain.model;
  if (!retraction_load(body, *scenario.retraction).isZero(0.0)) return {};
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("scenario {} does nothing on this case: its spatula of radius {:g} mm "
                          "presses on no node of the opening",
                          scenario.name, scenario.retraction->radius_mm));
}

bool depends_on_contact(const Scenario& scenario) {
  return scenario.adverse.gap_seed || scenario.adverse.penalty_factor != 1.0;
}

void ContactSeen::add(const BrainModel& model, int active, const Points& displacement) {
  active_ = active_ || active > 0;
  if (either()) return;
  const auto pairs = contact::search_contact(model.mesh.nodes, model.slaves, model.skull);
  if (!pairs || pairs->empty()) return;
  const contact::PenaltyContact contact(*pairs, 1.0);
  with_the_case_ = contact.penetration(displacement).maxCoeff() > 0.0;
}

Status check_contact(const Scenario& scenario, const ContactSeen& seen) {
  if (scenario.adverse.penalty_factor != 1.0 && !seen.active()) {
    return nothing(scenario, "penalty", "no slave touches the skull");
  }
  if (scenario.adverse.gap_seed && !seen.either()) {
    return nothing(scenario, "gap", "no slave touches the skull, nor would it with the case's gap");
  }
  return {};
}

}  // namespace brainshift::client
