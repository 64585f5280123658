// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/truth_load.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/tools/twin/load.hpp"
#include "common/contact/forward_model.hpp"
#include "common/fem/body_loads.hpp"

namespace brainshift::client {
namespace {

constexpr double kLoadRadiansPerDegree = std::numbers::pi / 180.0;

Vec3 turned(const Vec3& direction, const Vec3& turn_deg) {
  const Vec3 turn = kLoadRadiansPerDegree * turn_deg;
  return Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()) * direction;
}

Vec3 value_at(const io::ScorePoint& point, const Points& u) {
  Vec3 value = Vec3::Zero();
  for (int k = 0; k < 4; ++k) value += point.weights[k] * u.col(point.nodes[k]);
  return value;
}

double angle_deg(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

Status nothing(const Scenario& scenario, const std::string& ingredient, const std::string& why) {
  return invalid(fmt::format("adverse ingredient {} does nothing in scenario {} on this case: {}",
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

Vec3 tilted_gravity(const BrainModel& model, double tilt_deg) {
  const Vec3 axis =
      (craniotomy_centre(model) - Vec3(model.tumour.vertices.rowwise().mean())).normalized();
  return Eigen::AngleAxisd(tilt_deg * kLoadRadiansPerDegree, axis) * model.gravity_direction;
}

Gravity gravity_of(const BrainModel& model, const Scenario& scenario) {
  const Vec3& error = scenario.adverse.gravity_error_deg;
  if (scenario.gravity_tilt_deg == 0.0 && scenario.gravity_turn_deg.isZero(0.0) &&
      error.isZero(0.0)) {
    return {model.gravity_direction, model.fluid_plane_depth_mm};
  }
  const Vec3 direction = turned(
      turned(tilted_gravity(model, scenario.gravity_tilt_deg), scenario.gravity_turn_deg), error);
  const Points nodes = model.mesh.nodes(Eigen::all, model.craniotomy);
  return {direction, (direction.transpose() * nodes).maxCoeff()};
}

Points gravity_load(const TruthBrain& brain, const Gravity& gravity, double fluid_level_mm) {
  const double plane = gravity.fluid_plane_depth_mm + fluid_level_mm;
  const Material& material = brain.config.material;
  if (brain.elsewhere) {
    return fem::buoyancy_load(brain.elsewhere->space, material, gravity.direction, plane);
  }
  return fem::buoyancy_load(brain.tissue, material, gravity.direction, plane, gravity.direction);
}

namespace {

Points volume_load(const TruthBrain& brain, const Scenario& scenario) {
  const Material& material = brain.config.material;
  const Vec3 centre = swelling_centre(brain.model, scenario.swelling);
  const Vec3 tumour = brain.model.tumour.vertices.rowwise().mean();
  if (brain.elsewhere) {
    const auto change = volume_change_field(brain.model.mesh, tumour, scenario.volume);
    return fem::swelling_load(brain.elsewhere->space, material, [&](const Vec3& x) {
      return volume_strain_at(scenario.swelling, (x - centre).norm()) + change(x);
    });
  }
  Points load = swelling_load(brain.tissue, material, centre, scenario.swelling);
  if (scenario.volume.strain != 0.0) {
    load += volume_change_load(brain.tissue, material, tumour, scenario.volume);
  }
  return load;
}

}  // namespace

Points constant_load(const TruthBrain& brain, const Scenario& scenario) {
  Points load = volume_load(brain, scenario);
  if (!scenario.retraction) return load;
  // With another mesh at its own vertices, which are the first nodes of its space.
  const BrainModel& body = brain.elsewhere ? brain.elsewhere->model : brain.model;
  load.leftCols(body.mesh.num_nodes()) += retraction_load(body, *scenario.retraction);
  return load;
}

Points displacement_at_nodes(const TruthBrain& brain, const Points& u) {
  if (!brain.elsewhere) return u;
  return brain.elsewhere->nodes.displacement(brain.elsewhere->space, u);
}

Points displacement_of_tumour(const TruthBrain& brain, const Points& u) {
  if (brain.elsewhere) return brain.elsewhere->tumour.displacement(brain.elsewhere->space, u);
  Points values(3, static_cast<Eigen::Index>(brain.tumour.size()));
  for (std::size_t k = 0; k < brain.tumour.size(); ++k) {
    values.col(static_cast<Eigen::Index>(k)) = value_at(brain.tumour[k], u);
  }
  return values;
}

Status check_gravity(const TruthBrain& brain, const Scenario& scenario) {
  if (scenario.gravity_tilt_deg != 0.0) {
    const double turned = angle_deg(tilted_gravity(brain.model, scenario.gravity_tilt_deg),
                                    brain.model.gravity_direction);
    if (turned < kMinTilt_deg) {
      return invalid(fmt::format(
          "scenario {} does nothing on this case: gravity lies along the axis from the tumour to "
          "the craniotomy, so that {:g} degrees about it turn gravity by {:.1f}",
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
  return invalid(
      fmt::format("scenario {} does nothing on this case: its spatula of radius {:g} mm presses on "
                  "no node of the opening",
                  scenario.name, scenario.retraction->radius_mm));
}

bool depends_on_contact(const Scenario& scenario) {
  return scenario.adverse.gap_seed || scenario.adverse.penalty_factor != 1.0;
}

void ContactSeen::add(const BrainModel& model, int active, const Points& displacement) {
  active_ = active_ || active > 0;
  if (either()) return;
  const auto pairs = contact::contact_pairs(model);
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
