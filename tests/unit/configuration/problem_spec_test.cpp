// SPDX-License-Identifier: Apache-2.0
#include "common/configuration/problem_spec.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "tests/support/results.hpp"

namespace brainshift {
namespace {

ProblemSpec valid() {
  ProblemSpec problem;
  problem.element = "p2";
  MaterialSpec tissue;
  tissue.name = "tissue";
  tissue.youngs_modulus_pa = 3000.0;
  tissue.poisson_ratio = 0.45;
  problem.materials = {tissue};
  problem.regions = {{"all", "tissue"}};
  problem.groups = {{"floor", PlaneSelector{Vec3::Zero(), Vec3::UnitZ(), 0.1}}};
  ConditionSpec held;
  held.name = "held";
  held.on = "floor";
  held.normal_displacement_mm = 0.0;
  problem.conditions = {held};
  problem.contact = {{"table", "floor", PlaneObstacleSpec{}, std::nullopt}};
  return problem;
}

TEST(ProblemSpec, AValidOneIsAccepted) {
  const Status status = validate(valid());
  EXPECT_TRUE(status.has_value()) << status.error().message;
}

TEST(ProblemSpec, InvalidValuesAreRejectedWithTheirKey) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    const char* key;
    std::function<void(ProblemSpec&)> change;
  };
  const std::vector<Case> cases = {
      {"mesh.element = p3", [](auto& p) { p.element = "p3"; }},
      {"materials:", [](auto& p) { p.materials.clear(); }},
      {"regions:", [](auto& p) { p.regions.clear(); }},
      {"materials.tissue.youngs_modulus_pa: give",
       [](auto& p) { p.materials[0].shear_modulus_pa = 1000.0; }},
      {"materials.tissue.youngs_modulus_pa: give",
       [](auto& p) { p.materials[0].youngs_modulus_pa.reset(); }},
      {"materials.tissue.youngs_modulus_pa = 0",
       [](auto& p) { p.materials[0].youngs_modulus_pa = 0.0; }},
      {"materials.tissue.youngs_modulus_pa = nan",
       [nan](auto& p) { p.materials[0].youngs_modulus_pa = nan; }},
      {"materials.tissue.poisson_ratio = 0.5", [](auto& p) { p.materials[0].poisson_ratio = 0.5; }},
      {"materials.tissue.poisson_ratio = -1", [](auto& p) { p.materials[0].poisson_ratio = -1.0; }},
      {"materials.tissue.density_kg_m3", [](auto& p) { p.materials[0].density_kg_m3 = -1.0; }},
      {"materials.tissue.biot_coefficient", [](auto& p) { p.materials[0].biot_coefficient = 1.1; }},
      {"materials.tissue.storage_per_pa", [](auto& p) { p.materials[0].storage_per_pa = -1.0; }},
      {"materials.tissue.permeability_m3_s_kg",
       [](auto& p) { p.materials[0].permeability_m3_s_kg = -1.0; }},
      {"groups.floor.plane.normal",
       [](auto& p) {
         p.groups[0].where = PlaneSelector{Vec3::Zero(), Vec3::Zero(), 0.1};
       }},
      {"groups.floor.plane.tolerance_mm",
       [](auto& p) {
         p.groups[0].where = PlaneSelector{Vec3::Zero(), Vec3::UnitZ(), 0.0};
       }},
      {"groups.floor.box.max_mm",
       [](auto& p) {
         p.groups[0].where = BoxSelector{Vec3::Ones(), Vec3::Zero()};
       }},
      {"groups.floor.sphere.radius_mm",
       [](auto& p) {
         p.groups[0].where = SphereSelector{Vec3::Zero(), -1.0, 0.1};
       }},
      {"groups.floor.sphere.tolerance_mm",
       [](auto& p) {
         p.groups[0].where = SphereSelector{Vec3::Zero(), 1.0, 0.0};
       }},
      {"conditions.held: must have exactly one kind",
       [](auto& p) { p.conditions[0].pressure_pa = 1.0; }},
      {"conditions.held: must have exactly one kind",
       [](auto& p) { p.conditions[0].normal_displacement_mm.reset(); }},
      {"contact.table.plane.normal",
       [](auto& p) {
         p.contact[0].obstacle = PlaneObstacleSpec{Vec3::Zero(), Vec3::Zero()};
       }},
      {"contact.table.sphere.radius_mm",
       [](auto& p) { p.contact[0].obstacle = SphereObstacleSpec{}; }},
      {"contact.table.penalty_pa_per_mm", [](auto& p) { p.contact[0].penalty_pa_per_mm = 0.0; }},
      {"time.steps_s: must hold", [](auto& p) { p.time = TimeSpec{}; }},
      {"time.steps_s = -1",
       [](auto& p) {
         p.time = TimeSpec{{1.0, -1.0}};
       }},
  };
  for (const Case& each : cases) {
    ProblemSpec problem = valid();
    each.change(problem);
    EXPECT_THAT(refusal_of(validate(problem), ErrorCode::kInvalidArgument),
                testing::StartsWith(each.key));
  }
}

}  // namespace
}  // namespace brainshift
