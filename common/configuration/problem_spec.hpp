// SPDX-License-Identifier: Apache-2.0
// ProblemSpec: one forward problem as a problem file states it (docs/solve.md), in the file's
// units. forward::build_problem resolves the names against a mesh.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift {

struct MaterialSpec {
  std::string name;
  // Exactly one of the two moduli.
  std::optional<double> youngs_modulus_pa, shear_modulus_pa;
  double poisson_ratio = 0.0;
  double density_kg_m3 = 0.0;
  // Read by problems with time steps.
  double biot_coefficient = 1.0;
  double storage_per_pa = 0.0;
  double permeability_m3_s_kg = 0.0;
};

// Vertices of the mesh's boundary by their place, and the boundary faces between them.
struct PlaneSelector {
  Vec3 point_mm = Vec3::Zero(), normal = Vec3::UnitZ();
  double tolerance_mm = 0.0;
};
struct BoxSelector {
  Vec3 min_mm = Vec3::Zero(), max_mm = Vec3::Zero();
};
struct SphereSelector {  // the shell |x - centre| = radius
  Vec3 centre_mm = Vec3::Zero();
  double radius_mm = 0.0, tolerance_mm = 0.0;
};
struct GroupSpec {
  std::string name;
  std::variant<PlaneSelector, BoxSelector, SphereSelector> where;
};

// Exactly one kind of condition. Displacement components may be given singly.
struct ConditionSpec {
  std::string name, on;
  std::array<std::optional<double>, 3> displacement_mm;
  std::optional<double> normal_displacement_mm;
  std::optional<Vec3> traction_pa;
  std::optional<double> pressure_pa;
  std::optional<double> pore_pressure_pa;  // problems with time steps
};

struct PlaneObstacleSpec {
  Vec3 point_mm = Vec3::Zero(), normal = Vec3::UnitZ();
};
struct SphereObstacleSpec {
  Vec3 centre_mm = Vec3::Zero();
  double radius_mm = 0.0;
};
struct SurfaceObstacleSpec {
  std::filesystem::path file;
};
struct ContactSpec {
  std::string name, on;
  std::variant<PlaneObstacleSpec, SphereObstacleSpec, SurfaceObstacleSpec> obstacle;
  std::optional<double> penalty_pa_per_mm;
};

struct TimeSpec {
  std::vector<double> steps_s;  // lengths, in order
};

struct ProbeSpec {
  std::string name;
  Vec3 at_mm = Vec3::Zero();
};

struct ProblemSpec {
  std::filesystem::path file;  // absolute
  std::filesystem::path mesh;
  std::string element;  // p1, p2; empty: p2, or p1 with time steps
  std::vector<GroupSpec> groups;
  std::vector<MaterialSpec> materials;
  std::vector<std::pair<std::string, std::string>> regions;  // volume group or "all", material
  Vec3 gravity_m_s2 = Vec3::Zero();
  Vec3 body_force_n_m3 = Vec3::Zero();
  std::vector<ConditionSpec> conditions;
  std::vector<ContactSpec> contact;
  std::optional<TimeSpec> time;
  std::vector<ProbeSpec> probes;
};

// Checks the range of every value. kInvalidArgument; the message begins with the key.
Status validate(const ProblemSpec& problem);

}  // namespace brainshift
