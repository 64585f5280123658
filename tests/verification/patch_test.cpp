// SPDX-License-Identifier: GPL-3.0-or-later
// Patch test and rigid motion (Irons & Razzaque 1972): a linear displacement on the boundary of a
// distorted mesh is found inside, with its constant stress, by P1 and P2; a quadratic one by P2.
// A rigid motion costs no force.

#include "tests/support/box_mesh.hpp"
#include "tests/support/study_record.hpp"
#include "tests/verification/forward_fixture.hpp"

namespace brainshift::verification {
namespace {

constexpr double kPatchSize = 10.0;
constexpr char kPatchSource[] = "Irons and Razzaque 1972";

TetMesh distorted_box(int cells) {
  TetMesh mesh = test_support::box_mesh(cells, cells, cells, Vec3::Constant(kPatchSize));
  test_support::perturb_interior(mesh, 0.15 * kPatchSize / cells, 7);
  return mesh;
}

Vec3 linear(const Vec3& x) {
  Mat3 gradient;
  gradient << 0.01, -0.02, 0.03, 0.005, 0.015, -0.01, -0.02, 0.01, 0.02;
  return Vec3(0.1, -0.2, 0.3) + gradient * x;
}

// Quadratic displacement with div u = 0 and lap u = 0, so that (lambda + G) grad div u + G lap u
// = 0 for every material: the stress is free of divergence.
Vec3 quadratic(const Vec3& x) {
  return 1e-3 * Vec3(x[0] * x[0] - x[1] * x[1], -2.0 * x[0] * x[1], x[0] * x[1]);
}

struct Patch {
  double displacement = 0.0;  // relative errors
  double stress = 0.0;
};

Patch patch(fem::Element element, const fem::VectorField& field) {
  const fem::Elasticity material = elasticity(0.003, 0.3);
  auto problem = problem_on(distorted_box(4), element, material);
  add_condition(
      problem, "boundary", [](const Vec3&) { return true; }, forward::DisplacementField{field});
  const auto solution = solved(problem);
  Points exact(3, solution.space.num_nodes());
  for (int n = 0; n < solution.space.num_nodes(); ++n)
    exact.col(n) = field(solution.space.nodes.col(n));
  const double h = 1e-4;  // exact for quadratic fields up to rounding
  double stress = 0.0, scale = 0.0;
  for (int e = 0; e < solution.space.num_elements(); ++e) {
    Vec3 centre = Vec3::Zero();
    for (int k = 0; k < 4; ++k) centre += 0.25 * problem.mesh.nodes.col(problem.mesh.tets(k, e));
    Mat3 gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 step = h * Vec3::Unit(axis);
      gradient.col(axis) = (field(centre + step) - field(centre - step)) / (2.0 * h);
    }
    const fem::Stress expected = fem::stress_from(material, gradient);
    stress = std::max(stress, (solution.element_stress.col(e) - expected).norm());
    scale = std::max(scale, expected.norm());
  }
  return {(solution.displacement - exact).norm() / exact.norm(), stress / scale};
}

TEST(Patch, LinearFieldIsReproduced) {
  for (const fem::Element element : {fem::Element::kP1, fem::Element::kP2}) {
    const Patch errors = patch(element, linear);
    const std::string name = name_of(element);
    EXPECT_TRUE(test_support::record_check("patch", name + " displacement", errors.displacement,
                                           "<= 1e-12", errors.displacement <= 1e-12, kPatchSource));
    EXPECT_TRUE(test_support::record_check("patch", name + " stress", errors.stress, "<= 1e-9",
                                           errors.stress <= 1e-9, kPatchSource));
  }
}

TEST(Patch, QuadraticFieldIsReproducedByQuadraticElementsOnly) {
  const Patch p2 = patch(fem::Element::kP2, quadratic);
  EXPECT_TRUE(test_support::record_check("patch", "P2 quadratic displacement", p2.displacement,
                                         "<= 1e-12", p2.displacement <= 1e-12, kPatchSource));
  EXPECT_LE(p2.stress, 1e-8);
  EXPECT_GT(patch(fem::Element::kP1, quadratic).displacement, 1e-4);
}

TEST(RigidMotion, CostsNoForce) {
  for (const fem::Element element : {fem::Element::kP1, fem::Element::kP2}) {
    const auto space = fem::make_space(distorted_box(3), element);
    const auto materials =
        fem::MaterialMap::uniform({elasticity(0.003, 0.45)}, space.num_elements());
    const Vec3 axis(0.3, -0.4, 0.5);
    Points rigid(3, space.num_nodes()), stretch(3, space.num_nodes());
    for (int n = 0; n < space.num_nodes(); ++n) {
      rigid.col(n) = Vec3(1.0, 2.0, 3.0) + axis.cross(Vec3(space.nodes.col(n)));
      stretch.col(n) = axis.asDiagonal() * Vec3(space.nodes.col(n));
    }
    const double scale = fem::internal_force(space, materials, stretch).norm();
    ASSERT_GT(scale, 0.0);
    const double force = fem::internal_force(space, materials, rigid).norm() / scale;
    EXPECT_TRUE(test_support::record_check("patch",
                                           std::string(name_of(element)) + " rigid motion force",
                                           force, "<= 1e-12", force <= 1e-12, kPatchSource));
  }
}

}  // namespace
}  // namespace brainshift::verification
