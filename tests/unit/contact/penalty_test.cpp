// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/penalty.hpp"

#include <gtest/gtest.h>

#include "common/contact/forward_model.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::contact {
namespace {

using test_support::box_mesh;
using test_support::nodes_where;

TEST(PenaltyContact, PenetrationFollowsEquation11) {
  // One slave 1 mm below a ceiling whose normal points down into the body.
  const ContactPair pair{0, Vec3(0, 0, 1), Vec3(0, 0, -1), -1.0};
  const PenaltyContact contact({pair}, 5.0);
  Points u = Points::Zero(3, 1);
  EXPECT_DOUBLE_EQ(contact.penetration(u)[0], -1.0);
  u(2, 0) = 0.4;
  EXPECT_DOUBLE_EQ(contact.penetration(u)[0], -0.6);
  EXPECT_EQ(count(contact.penetrating(u)), 0);
  u(2, 0) = 1.3;
  EXPECT_NEAR(contact.penetration(u)[0], 0.3, 1e-15);
  EXPECT_EQ(count(contact.penetrating(u)), 1);
  u << 9, 9, 0;  // sliding along the ceiling does not close the gap
  EXPECT_DOUBLE_EQ(contact.penetration(u)[0], -1.0);
}

// A column on a floor is pulled upwards against a ceiling by a uniform traction. By hand: without
// ceiling its top rises by u0 = t H / E' with E' the column's modulus; the ceiling at gap g < u0
// holds it at g, so the total contact force is (u0 - g) / u0 of the total pull.
class Column : public ::testing::Test {
 protected:
  static constexpr double kHeight = 30.0, kWidth = 20.0;
  TetMesh mesh = box_mesh(2, 2, 3, Vec3(kWidth, kWidth, kHeight));
  fem::Elasticity tissue{0.0, 0.0021};  // nu = 0: no lateral motion, E' = E = 2 G
  fem::DofMap dofs{mesh.num_nodes()};
  std::vector<NodeIndex> top = nodes_where(mesh, [](const Vec3& x) { return x[2] == kHeight; });
  Points load = Points::Zero(3, mesh.num_nodes());
  double traction = 2.8e-4;  // N/mm^2: u0 = 2 mm
  double free_rise = traction * kHeight / (2 * tissue.shear);

  void SetUp() override {
    for (NodeIndex n : nodes_where(mesh, [](const Vec3& x) { return x[2] == 0.0; }))
      dofs.fix_all(n);
    dofs.finalise();
    const auto faces = geometry::boundary_triangles(mesh);
    for (Eigen::Index f = 0; f < faces.cols(); ++f) {
      bool on_top = true;
      for (int k = 0; k < 3; ++k) on_top = on_top && mesh.nodes(2, faces(k, f)) == kHeight;
      if (!on_top) continue;
      const Vec3 a = mesh.nodes.col(faces(0, f)), b = mesh.nodes.col(faces(1, f)),
                 c = mesh.nodes.col(faces(2, f));
      const double third = (b - a).cross(c - a).norm() / 6.0;
      for (int k = 0; k < 3; ++k) load(2, faces(k, f)) += third * traction;
    }
  }
  ContactSolution solve(double gap, double beta, double* total_force) {
    std::vector<ContactPair> pairs;
    for (NodeIndex n : top) {
      pairs.push_back({n, Vec3(mesh.nodes.col(n)) + Vec3(0, 0, gap), Vec3(0, 0, -1), -gap});
    }
    const PenaltyContact contact(pairs, beta);
    const auto stiffness = fem::assemble_stiffness(mesh, tissue, dofs);
    auto factor = linalg::SparseCholesky::factorise(stiffness);
    EXPECT_TRUE(factor.has_value());
    const auto solution = solve_with_contact(stiffness, fem::StiffnessFactor(std::move(*factor)),
                                             dofs, contact, load);
    EXPECT_TRUE(solution.has_value());
    const VecX p = contact.penetration(solution->displacement);
    *total_force = 0.0;
    for (int i = 0; i < p.size(); ++i) {
      if (solution->active[static_cast<std::size_t>(i)]) *total_force += beta * p[i];
    }
    return *solution;
  }
};

TEST_F(Column, RisesFreelyUnderAnOpenGap) {
  double force = -1.0;
  const ContactSolution solution = solve(free_rise + 0.1, 5.0, &force);
  EXPECT_TRUE(solution.converged);
  EXPECT_EQ(count(solution.active), 0);
  EXPECT_EQ(force, 0.0);
  for (NodeIndex n : top) EXPECT_NEAR(solution.displacement(2, n), free_rise, 1e-11);
}

TEST_F(Column, ContactForceEqualsTheHandComputedOne) {
  const double gap = 0.75;
  const double pull = traction * kWidth * kWidth;
  double force = 0.0;
  const ContactSolution solution = solve(gap, 1e5, &force);
  EXPECT_TRUE(solution.converged);
  EXPECT_EQ(count(solution.active), static_cast<int>(top.size()));
  // The penalty yields force / beta, about 1e-7 of the gap.
  EXPECT_NEAR(force, pull * (free_rise - gap) / free_rise, 1e-6 * pull);
  for (NodeIndex n : top) EXPECT_NEAR(solution.displacement(2, n), gap, 1e-6);
}

TEST_F(Column, SofterPenaltyPenetratesByForceOverBeta) {
  double stiff_force = 0.0, soft_force = 0.0;
  solve(0.75, 1e5, &stiff_force);
  const ContactSolution soft = solve(0.75, 5.0, &soft_force);
  EXPECT_LT(soft_force, stiff_force);
  double penetration = 0.0;
  for (NodeIndex n : top) penetration = std::max(penetration, soft.displacement(2, n) - 0.75);
  EXPECT_GT(penetration, 0.0);
  EXPECT_LT(penetration, 0.01);
}

TEST(ForwardModel, ContactSolutionPressesActiveSlavesAndLeavesTheOthersOpen) {
  const BrainModel model = test_support::toy_patient();
  const auto forward = ForwardModel::build(model, test_support::toy_config(), Boundary::kContact);
  ASSERT_TRUE(forward.has_value()) << forward.error().message;
  Points load = Points::Zero(3, model.mesh.num_nodes());
  load.row(2).setConstant(0.02);  // lift, so that part of the dome touches
  const auto solution = forward->solve_with_contact(load);
  ASSERT_TRUE(solution.has_value());
  EXPECT_TRUE(solution->converged);
  const int active = count(solution->active);
  EXPECT_GT(active, 0);
  EXPECT_LT(active, forward->contact().num_slaves());
  const VecX p = forward->contact().penetration(solution->displacement);
  for (int i = 0; i < p.size(); ++i)
    EXPECT_EQ(p[i] > 0.0, solution->active[static_cast<std::size_t>(i)] != 0);
  // Without contact the same load would go deep into the skull.
  EXPECT_GT(forward->contact().penetration(forward->solve(load)).maxCoeff(), 10 * p.maxCoeff());
}

TEST(ForwardModel, FixedBoundaryHoldsSlavesInTheNormalAndLetsThemSlide) {
  const BrainModel model = test_support::toy_patient();
  const auto forward = ForwardModel::build(model, test_support::toy_config(), Boundary::kFixed);
  ASSERT_TRUE(forward.has_value()) << forward.error().message;
  EXPECT_EQ(forward->contact().num_slaves(), 0);
  Points load = Points::Zero(3, model.mesh.num_nodes());
  load.row(2).setConstant(-0.02);
  const Points u = forward->solve(load);
  const Points normals = geometry::vertex_normals({model.mesh.nodes, model.boundary_triangles});
  double slide = 0.0;
  for (NodeIndex n : model.slaves) {
    EXPECT_NEAR(u.col(n).dot(normals.col(n)), 0.0, 1e-12);
    slide = std::max(slide, u.col(n).norm());
  }
  EXPECT_GT(slide, 0.1);
}

TEST(ForwardModel, ReportsABodyWithoutFixedNodes) {
  BrainModel model = test_support::toy_patient();
  model.slaves.insert(model.slaves.end(), model.fixed.begin(), model.fixed.end());
  model.fixed.clear();
  const auto forward = ForwardModel::build(model, test_support::toy_config(), Boundary::kContact);
  ASSERT_FALSE(forward.has_value());
  EXPECT_EQ(forward.error().code, ErrorCode::kFloatingBody);
}

}  // namespace
}  // namespace brainshift::contact
