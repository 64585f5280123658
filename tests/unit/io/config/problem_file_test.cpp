// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/problem_file.hpp"

#include <gmock/gmock.h>

#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using testing::ElementsAre;
using testing::Pair;

TEST(ProblemFile, EveryKeyIsRead) {
  const auto problem = parse_problem(R"(
mesh: {file: m.msh, element: p1}
groups:
  a: {plane: {point_mm: [1, 2, 3], normal: [0, 0, 1], tolerance_mm: 0.5}}
  b: {box: {min_mm: [0, 0, 0], max_mm: [1, 1, 1]}}
  c: {sphere: {centre_mm: [0, 0, 0], radius_mm: 4, tolerance_mm: 0.1}}
materials:
  m: {shear_modulus_pa: 1000, poisson_ratio: 0.4, density_kg_m3: 7, biot_coefficient: 0.9, storage_per_pa: 1e-6, permeability_m3_s_kg: 1e-7}
regions: {white: m, all: m}
body: {gravity_m_s2: [0, 0, -9.8], force_n_m3: [1, 0, 0]}
conditions:
  u: {on: a, displacement_mm: [1, 2, 3]}
  v: {on: a, displacement_y_mm: 4}
  n: {on: a, normal_displacement_mm: 0}
  t: {on: b, traction_pa: [1, 2, 3]}
  p: {on: b, pressure_pa: 5}
  q: {on: b, pore_pressure_pa: 0}
contact:
  f: {on: c, plane: {point_mm: [0, 0, -1], normal: [0, 0, 2]}, penalty_pa_per_mm: 3}
  s: {on: c, surface: floor.stl}
time: {steps_s: [1, 2]}
probes: {tip: [1, 2, 3]}
)",
                                     "/data/p.yaml");
  ASSERT_TRUE(problem) << problem.error().message;
  EXPECT_EQ(problem->mesh, "/data/m.msh");
  EXPECT_EQ(problem->element, "p1");
  EXPECT_EQ(std::get<SphereSelector>(problem->groups[2].where).radius_mm, 4.0);
  EXPECT_EQ(problem->materials[0].permeability_m3_s_kg, 1e-7);
  EXPECT_THAT(problem->regions, ElementsAre(Pair("white", "m"), Pair("all", "m")));
  EXPECT_EQ(problem->body_force_n_m3, Vec3(1, 0, 0));
  ASSERT_EQ(problem->conditions.size(), 6U);
  EXPECT_EQ(problem->conditions[0].displacement_mm[2], 3.0);
  EXPECT_FALSE(problem->conditions[1].displacement_mm[0]);
  EXPECT_EQ(problem->conditions[3].traction_pa, Vec3(1, 2, 3));
  EXPECT_EQ(problem->conditions[5].pore_pressure_pa, 0.0);
  EXPECT_EQ(problem->contact[0].penalty_pa_per_mm, 3.0);
  EXPECT_EQ(std::get<SurfaceObstacleSpec>(problem->contact[1].obstacle).file, "/data/floor.stl");
  EXPECT_THAT(problem->time->steps_s, ElementsAre(1.0, 2.0));
  EXPECT_EQ(problem->probes[0].at_mm, Vec3(1, 2, 3));
}

const std::string kMaterials =
    "materials: {m: {shear_modulus_pa: 1000, poisson_ratio: 0.4}}\nregions: {all: m}\n";

TEST(ProblemFile, BadFilesAreRefusedWithFileLineAndKey) {
  const auto read = [](const std::string& lines) {
    return parse_problem("mesh: {file: m.msh}\n" + lines, "/data/p.yaml");
  };
  test_support::expect_refused(
      read,
      {{"", "/data/p.yaml: materials, regions: keys are missing"},
       {kMaterials + "gravity: 1\n", "/data/p.yaml:4: gravity: unknown key"},
       {kMaterials + "groups: {a: {cone: {}}}\n",
        "/data/p.yaml:4: groups.a has none: must have exactly one of plane"},
       {"materials: {m: {shear_modulus_pa: soft, poisson_ratio: 0.4}}\n",
        "/data/p.yaml:2: materials.m.shear_modulus_pa = soft: must be"},
       {kMaterials + "time: {steps_s: 1}\n", "/data/p.yaml:4: time.steps_s = 1: must be a list"}},
      ErrorCode::kInvalidArgument);
  EXPECT_EQ(read_problem("/nowhere/p.yaml").error().code, ErrorCode::kNotFound);
}

// What a later stage finds wrong is told with the line of its key.
TEST(ProblemFile, ALaterErrorIsLocated) {
  const test_support::TemporaryFolder folder;
  const auto path = folder.write("p.yaml", "mesh: {file: m.msh}\n# a remark\nregions: {all: m}\n");
  const Error located =
      locate_in_problem(path, {ErrorCode::kInvalidArgument, "regions.all: names no material"});
  EXPECT_EQ(located.message, path.string() + ":3: regions.all: names no material");
}

}  // namespace
}  // namespace brainshift::io
