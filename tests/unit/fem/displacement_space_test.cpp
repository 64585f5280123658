// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/displacement_space.hpp"

#include <gtest/gtest.h>

#include "common/fem/space_elasticity.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"

namespace brainshift::fem {
namespace {

constexpr Elasticity kSpaceTissue{0.003, 0.0021};

TetMesh distorted() {
  TetMesh mesh = test_support::box_mesh(2, 3, 2, Vec3(4.0, 5.0, 6.0));
  test_support::perturb_interior(mesh, 0.3, 5);
  return mesh;
}

TEST(DisplacementSpace, ShapeFunctionsAreOneAtTheirNodeAndSumToOne) {
  for (const Element element : {Element::kP1, Element::kP2}) {
    const DisplacementSpace space = make_space(distorted(), element);
    const Eigen::Matrix<double, 3, 4> vertices =
        space.mesh.nodes(Eigen::all, space.mesh.tets.col(7));
    for (int k = 0; k < space.nodes_per_element(); ++k) {
      const Vec3 x = space.nodes.col(space.elements(k, 7));
      Eigen::Vector4d l;
      Eigen::Matrix4d system;
      system << vertices, Eigen::RowVector4d::Ones();
      l = system.inverse() * x.homogeneous();
      const ShapeValues n = shape_values(element, l);
      for (int j = 0; j < n.size(); ++j) EXPECT_NEAR(n[j], j == k ? 1.0 : 0.0, 1e-12);
    }
    EXPECT_NEAR(shape_values(element, Eigen::Vector4d(0.1, 0.2, 0.3, 0.4)).sum(), 1.0, 1e-15);
  }
}

TEST(DisplacementSpace, GradientsAreDerivativesOfTheShapeFunctions) {
  const DisplacementSpace space = make_space(distorted(), Element::kP2);
  const TetGeometry geometry = tet_geometry(space.mesh, 3);
  const Eigen::Vector4d l(0.1, 0.2, 0.3, 0.4);
  const ShapeGradients g = shape_gradients(Element::kP2, geometry.gradients, l);
  const double h = 1e-6;
  ASSERT_GT(g.norm(), 0.1);
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector4d step = h * geometry.gradients.row(axis).transpose();
    const ShapeValues slope =
        (shape_values(Element::kP2, l + step) - shape_values(Element::kP2, l - step)) / (2.0 * h);
    EXPECT_LT((slope - g.row(axis).transpose()).norm(), 1e-8);
  }
}

TEST(DisplacementSpace, FaceNodesLieOnTheFace) {
  const DisplacementSpace space = make_space(distorted(), Element::kP2);
  const Eigen::Vector3i face = space.mesh.tets.col(0).head<3>();
  const auto nodes = face_nodes(space, face);
  const Vec3 middle = 0.5 * (space.nodes.col(face[2]) + space.nodes.col(face[0]));
  EXPECT_LT((space.nodes.col(nodes[5]) - middle).norm(), 1e-14);
  // The longest diagonal of the box joins two vertices that share no tetrahedron.
  EXPECT_EQ(face_nodes(space, {0, space.num_vertices() - 1, face[0]})[3], -1);
}

TEST(QuadratureRules, IntegrateMonomialsExactly) {
  // int l1^2 l2 l3 over a tetrahedron of volume 1: 3! 2! 1! 1! / (3 + 4)! = 12 / 5040.
  double tet = 0.0;
  for (const TetPoint& q : fine_tet_rule()) tet += q.weight * q.l[0] * q.l[0] * q.l[1] * q.l[2];
  EXPECT_NEAR(tet, 12.0 / 5040.0, 1e-15);
  // int l1^2 l2^2 over a triangle of area 1: 2! 2! 2! / (2 + 4)! = 8 / 720.
  double triangle = 0.0;
  for (const TrianglePoint& q : fine_triangle_rule()) {
    triangle += q.weight * q.l[0] * q.l[0] * q.l[1] * q.l[1];
  }
  EXPECT_NEAR(triangle, 8.0 / 720.0, 1e-15);
}

TEST(SpaceStiffness, OfLinearElementsIsTheUniformOne) {
  const DisplacementSpace space = make_space(distorted(), Element::kP1);
  DofMap dofs(space.num_nodes());
  dofs.fix_normal(0, Vec3(0.6, 0.0, 0.8));
  dofs.fix_all(5);
  dofs.finalise();
  const auto materials = MaterialMap::uniform({kSpaceTissue}, space.num_elements());
  const linalg::SymmetricMatrix general = assemble_stiffness(space, materials, dofs);
  const linalg::SymmetricMatrix uniform = assemble_stiffness(space.mesh, kSpaceTissue, dofs);
  ASSERT_GT(uniform.norm(), 0.0);
  EXPECT_LT((general - uniform).norm(), 1e-14 * uniform.norm());
}

TEST(SpaceStiffness, AgreesWithTheInternalForce) {
  for (const Element element : {Element::kP1, Element::kP2}) {
    const DisplacementSpace space = make_space(distorted(), element);
    MaterialMap materials = MaterialMap::uniform({kSpaceTissue}, space.num_elements());
    materials.materials.push_back({Elasticity{0.1, 0.07}});
    materials.of_tet[4] = 1;
    DofMap dofs(space.num_nodes());
    dofs.finalise();
    const Points u = Points::Random(3, space.num_nodes());
    const VecX product =
        linalg::multiply(assemble_stiffness(space, materials, dofs), dofs.restrict_to(u));
    const VecX force = dofs.restrict_to(internal_force(space, materials, u));
    ASSERT_GT(force.norm(), 0.0);
    EXPECT_LT((product - force).norm(), 1e-12 * force.norm());
  }
}

TEST(Loads, CarryTheWholeForce) {
  for (const Element element : {Element::kP1, Element::kP2}) {
    const DisplacementSpace space = make_space(distorted(), element);
    const Vec3 density(1.0, -2.0, 3.0);
    const Points constant = body_load(space, Points(density.replicate(1, space.num_elements())));
    EXPECT_LT((constant.rowwise().sum() - 120.0 * density).norm(), 1e-10);
    const Points field = body_load(space, [&](const Vec3&) { return density; });
    EXPECT_LT((field - constant).norm(), 1e-12 * constant.norm());
    const Eigen::Vector3i face = space.mesh.tets.col(0).head<3>();
    const Points pressed = pressure_load(space, face, 2.0);
    const Vec3 a = space.nodes.col(face[0]), b = space.nodes.col(face[1]),
               c = space.nodes.col(face[2]);
    const Vec3 normal = (b - a).cross(c - a).normalized();
    const Points pulled =
        traction_load(space, face, [&](const Vec3&) { return Vec3(-2.0 * normal); });
    ASSERT_GT(pressed.norm(), 0.0);
    EXPECT_LT((pressed - pulled).norm(), 1e-12 * pressed.norm());
  }
}

TEST(DisplacementConstraints, SeveralDirectionsOfANodeAreAllHeld) {
  DisplacementConstraints constraints(3);
  const Vec3 n = Vec3(1.0, 2.0, 2.0) / 3.0;
  ASSERT_TRUE(constraints.add(0, n, 0.5, "a"));
  ASSERT_TRUE(constraints.add(0, Vec3::UnitX(), -0.25, "b"));
  ASSERT_TRUE(constraints.add(1, -Vec3::UnitZ(), 2.0, "a"));
  ASSERT_TRUE(constraints.add(1, Vec3::UnitZ(), -2.0, "b")) << "agrees";
  const ConstrainedDofs built = constraints.build();
  EXPECT_EQ(built.dofs.num_unknowns(), 1 + 2 + 3);
  EXPECT_TRUE(built.dofs.has_identity_frame(1));
  const Points u = built.dofs.expand(VecX::LinSpaced(6, 1.0, 6.0)) + built.lift;
  EXPECT_NEAR(u.col(0).dot(n), 0.5, 1e-14);
  EXPECT_NEAR(u(0, 0), -0.25, 1e-14);
  EXPECT_DOUBLE_EQ(u(2, 1), -2.0);
}

TEST(DisplacementConstraints, AContradictionNamesBothSources) {
  DisplacementConstraints constraints(1);
  ASSERT_TRUE(constraints.add_all(0, Vec3(1.0, 2.0, 3.0), "conditions.a"));
  EXPECT_THAT(
      sentence_of(constraints.add(0, Vec3(0.0, 0.6, 0.8), 0.0, "conditions.b")),
      testing::AllOf(testing::HasSubstr("conditions.a"), testing::HasSubstr("conditions.b")));
}

}  // namespace
}  // namespace brainshift::fem
