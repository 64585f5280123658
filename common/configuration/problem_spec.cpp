// SPDX-License-Identifier: Apache-2.0
#include "common/configuration/problem_spec.hpp"

#include <algorithm>

#include "common/configuration/key_table.hpp"

namespace brainshift {
namespace {

constexpr double kMaxPoissonRatio = 0.4999;

// The first problem found; later checks are skipped.
class Checks {
 public:
  void that(bool holds, const std::string& key, double value, const std::string& constraint) {
    if (!holds && status_) refuse(must_be(key, value, constraint));
  }
  void that(bool holds, const std::string& message) {
    if (!holds && status_) refuse(message);
  }
  // Where it is given.
  void positive(const std::string& key, std::optional<double> value) {
    if (value) that(*value > 0.0, key, *value, "> 0");
  }
  void not_negative(const std::string& key, double value) {
    that(value >= 0.0, key, value, ">= 0");
  }
  Status status() const { return status_; }

 private:
  void refuse(const std::string& message) { status_ = invalid(message); }
  Status status_;
};

void check(const MaterialSpec& m, Checks& checks) {
  const std::string key = "materials." + m.name + ".";
  checks.that(m.youngs_modulus_pa.has_value() != m.shear_modulus_pa.has_value(),
              key + "youngs_modulus_pa: give this or shear_modulus_pa, not both");
  checks.positive(key + "youngs_modulus_pa", m.youngs_modulus_pa);
  checks.positive(key + "shear_modulus_pa", m.shear_modulus_pa);
  checks.that(m.poisson_ratio > -1.0 && m.poisson_ratio <= kMaxPoissonRatio, key + "poisson_ratio",
              m.poisson_ratio,
              "> -1 and <= 0.4999 (an incompressible body needs a pressure field)");
  checks.not_negative(key + "density_kg_m3", m.density_kg_m3);
  checks.that(m.biot_coefficient >= 0.0 && m.biot_coefficient <= 1.0, key + "biot_coefficient",
              m.biot_coefficient, "between 0 and 1");
  checks.not_negative(key + "storage_per_pa", m.storage_per_pa);
  checks.not_negative(key + "permeability_m3_s_kg", m.permeability_m3_s_kg);
}

void check(const GroupSpec& group, Checks& checks) {
  const std::string key = "groups." + group.name + ".";
  if (const auto* plane = std::get_if<PlaneSelector>(&group.where)) {
    checks.that(plane->normal.norm() > 0.0, key + "plane.normal: must have a length > 0");
    checks.positive(key + "plane.tolerance_mm", plane->tolerance_mm);
  } else if (const auto* box = std::get_if<BoxSelector>(&group.where)) {
    checks.that((box->max_mm - box->min_mm).minCoeff() >= 0.0,
                key + "box.max_mm: must not be below min_mm in any component");
  } else {
    const auto& sphere = std::get<SphereSelector>(group.where);
    checks.not_negative(key + "sphere.radius_mm", sphere.radius_mm);
    checks.positive(key + "sphere.tolerance_mm", sphere.tolerance_mm);
  }
}

void check(const ConditionSpec& condition, Checks& checks) {
  const auto given = [](const std::optional<double>& value) { return value.has_value(); };
  const auto& u = condition.displacement_mm;
  const int kinds = static_cast<int>(std::any_of(u.begin(), u.end(), given)) +
                    static_cast<int>(condition.normal_displacement_mm.has_value()) +
                    static_cast<int>(condition.traction_pa.has_value()) +
                    static_cast<int>(condition.pressure_pa.has_value()) +
                    static_cast<int>(condition.pore_pressure_pa.has_value());
  checks.that(kinds == 1,
              "conditions." + condition.name +
                  ": must have exactly one kind of displacement_mm (or its components), "
                  "normal_displacement_mm, traction_pa, pressure_pa, pore_pressure_pa");
}

void check(const ContactSpec& contact, Checks& checks) {
  const std::string key = "contact." + contact.name + ".";
  if (const auto* plane = std::get_if<PlaneObstacleSpec>(&contact.obstacle)) {
    checks.that(plane->normal.norm() > 0.0, key + "plane.normal: must have a length > 0");
  } else if (const auto* sphere = std::get_if<SphereObstacleSpec>(&contact.obstacle)) {
    checks.positive(key + "sphere.radius_mm", sphere->radius_mm);
  }
  checks.positive(key + "penalty_pa_per_mm", contact.penalty_pa_per_mm);
}

}  // namespace

Status validate(const ProblemSpec& problem) {
  Checks checks;
  checks.that(problem.element.empty() || problem.element == "p1" || problem.element == "p2",
              "mesh.element = " + problem.element + ": must be p1 or p2");
  checks.that(!problem.materials.empty(), "materials: must name at least one material");
  checks.that(!problem.regions.empty(),
              "regions: must give each region of the mesh a material (or: all: MATERIAL)");
  for (const MaterialSpec& material : problem.materials) check(material, checks);
  for (const GroupSpec& group : problem.groups) check(group, checks);
  for (const ConditionSpec& condition : problem.conditions) check(condition, checks);
  for (const ContactSpec& contact : problem.contact) check(contact, checks);
  if (problem.time) {
    checks.that(!problem.time->steps_s.empty(), "time.steps_s: must hold at least one step");
    for (const double step : problem.time->steps_s) checks.positive("time.steps_s", step);
  }
  return checks.status();
}

}  // namespace brainshift
