// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/elasticity.hpp"

#include <gtest/gtest.h>

#include "common/geometry/surface.hpp"
#include "common/linalg/cholesky.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/dense.hpp"

namespace brainshift::fem {
namespace {

using test_support::box_mesh;
using test_support::nodes_where;
using test_support::perturb_interior;

constexpr Elasticity kTissue{0.0242, 0.0021};  // Table 1: G = 2100 Pa, nu = 0.46

DofMap all_free(const TetMesh& mesh) {
  DofMap dofs(mesh.num_nodes());
  dofs.finalise();
  return dofs;
}

VecX flat(const Points& u) { return Eigen::Map<const VecX>(u.data(), u.size()); }

Points infinitesimal_rotation(const TetMesh& mesh, const Vec3& axis) {
  Points u(3, mesh.num_nodes());
  for (int n = 0; n < mesh.num_nodes(); ++n) u.col(n) = axis.cross(Vec3(mesh.nodes.col(n)));
  return u;
}

TEST(Elasticity, LameConstantsFollowFromTable1) {
  const Elasticity tissue = elasticity_from(Material{});
  EXPECT_DOUBLE_EQ(tissue.shear, 2.1e-3);                       // 2100 Pa in N/mm^2
  EXPECT_NEAR(tissue.lambda, 2 * 2.1e-3 * 0.46 / 0.08, 1e-15);  // 2 G nu / (1 - 2 nu)
}

TEST(Elasticity, RigidBodyMotionsCarryNoForce) {
  TetMesh mesh = box_mesh(3, 3, 3, Vec3(30, 20, 40));
  perturb_interior(mesh, 1.5, 7);
  const linalg::SymmetricMatrix k = assemble_stiffness(mesh, kTissue, all_free(mesh));
  const double scale = k.diagonal().maxCoeff();
  for (int axis = 0; axis < 3; ++axis) {
    Points translation = Points::Zero(3, mesh.num_nodes());
    translation.row(axis).setOnes();
    EXPECT_LT(linalg::multiply(k, flat(translation)).cwiseAbs().maxCoeff(), 1e-12 * scale);
    // Rotations move nodes by up to 40 mm, so rounding is that much larger.
    const Points rotation = infinitesimal_rotation(mesh, Vec3::Unit(axis));
    EXPECT_LT(linalg::multiply(k, flat(rotation)).cwiseAbs().maxCoeff(), 40 * 1e-12 * scale);
  }
}

TEST(Elasticity, StiffnessHasExactlySixZeroEnergyModes) {
  TetMesh mesh = box_mesh(2, 2, 2, Vec3(20, 20, 20));
  perturb_interior(mesh, 2.0, 3);
  const linalg::SymmetricMatrix lower = assemble_stiffness(mesh, kTissue, all_free(mesh));
  const linalg::SymmetricMatrix both = lower.selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd dense(both);
  const VecX eigenvalues = test_support::eigenvalues(dense);
  const double largest = eigenvalues[eigenvalues.size() - 1];
  EXPECT_LT(std::abs(eigenvalues[5]), 1e-13 * largest);
  EXPECT_GT(eigenvalues[6], 1e-6 * largest);
}

// Constant-strain patch test: a linear displacement prescribed on the boundary of an irregular
// patch is reproduced inside to rounding.
TEST(Elasticity, PatchTestReproducesLinearDisplacement) {
  TetMesh mesh = box_mesh(3, 4, 3, Vec3(30, 40, 30));
  perturb_interior(mesh, 2.0, 11);
  Mat3 gradient;
  gradient << 0.01, 0.03, -0.02, 0.00, -0.02, 0.01, 0.04, 0.02, 0.03;
  Points exact(3, mesh.num_nodes());
  for (int n = 0; n < mesh.num_nodes(); ++n) exact.col(n) = gradient * mesh.nodes.col(n);

  const auto on_boundary = [](const Vec3& x) {
    return x.cwiseProduct(Vec3(30, 40, 30) - x).minCoeff() == 0.0;
  };
  DofMap inside(mesh.num_nodes());
  for (NodeIndex node : nodes_where(mesh, on_boundary)) inside.fix_all(node);
  inside.finalise();
  ASSERT_GT(inside.num_unknowns(), 0);

  Points boundary_part = exact;
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    if (inside.unknown(n, 0) >= 0) boundary_part.col(n).setZero();
  }
  const linalg::SymmetricMatrix full = assemble_stiffness(mesh, kTissue, all_free(mesh));
  const VecX reaction = linalg::multiply(full, flat(boundary_part));
  const Points load = -Eigen::Map<const Points>(reaction.data(), 3, mesh.num_nodes());
  const auto factor = linalg::SparseCholesky::factorise(assemble_stiffness(mesh, kTissue, inside));
  ASSERT_TRUE(factor.has_value()) << factor.error().message;
  const Points u = inside.expand(factor->solve(inside.restrict_to(load))) + boundary_part;
  EXPECT_LT((u - exact).cwiseAbs().maxCoeff(), 1e-12 * exact.cwiseAbs().maxCoeff());
}

// Consistent nodal forces of a uniform traction on the face x[axis] == plane of a box mesh.
void add_traction(const TetMesh& box, int axis, double plane, const Vec3& traction, Points& load) {
  const auto faces = geometry::boundary_triangles(box);
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    const Vec3 a = box.nodes.col(faces(0, f)), b = box.nodes.col(faces(1, f)),
               c = box.nodes.col(faces(2, f));
    if (a[axis] != plane || b[axis] != plane || c[axis] != plane) continue;
    const double third = (b - a).cross(c - a).norm() / 6.0;
    for (int k = 0; k < 3; ++k) load.col(faces(k, f)) += third * traction;
  }
}

// A box on a sliding floor under tractions that keep its strain uniaxial stretches by u_z = t z /
// M with M = lambda + 2 G, which P1 holds exactly. Turning the whole problem turns the solution
// with it, which exercises normal-fixed frames that are not aligned with the axes.
TEST(Elasticity, SlidingFloorInRotatedFrameIsExact) {
  const Vec3 size(20, 20, 30);
  const TetMesh straight = box_mesh(2, 2, 3, size);
  const double traction = 1e-4;  // N/mm^2
  const double modulus = kTissue.lambda + 2 * kTissue.shear;
  const double lateral = kTissue.lambda * traction / modulus;
  Points load = Points::Zero(3, straight.num_nodes());
  add_traction(straight, 2, size[2], traction * Vec3::UnitZ(), load);
  for (int axis = 0; axis < 2; ++axis) {
    add_traction(straight, axis, size[axis], lateral * Vec3::Unit(axis), load);
    add_traction(straight, axis, 0.0, -lateral * Vec3::Unit(axis), load);
  }
  Points exact = Points::Zero(3, straight.num_nodes());
  exact.row(2) = traction / modulus * straight.nodes.row(2);

  for (const Mat3& turn :
       {Mat3(Mat3::Identity()), Mat3(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()))}) {
    TetMesh mesh = straight;
    mesh.nodes = turn * straight.nodes;
    DofMap dofs(mesh.num_nodes());
    for (NodeIndex n : nodes_where(straight, [](const Vec3& x) { return x[2] == 0.0; })) {
      dofs.fix_normal(n, turn * Vec3::UnitZ());
    }
    // Two held nodes stop the rigid motions that the floor allows; the exact solution does not
    // move them.
    dofs.fix_all(0);
    dofs.fix_all(1);
    dofs.finalise();
    const auto factor = linalg::SparseCholesky::factorise(assemble_stiffness(mesh, kTissue, dofs));
    ASSERT_TRUE(factor.has_value()) << factor.error().message;
    const Points u = dofs.expand(factor->solve(dofs.restrict_to(turn * load)));
    EXPECT_LT((u - turn * exact).cwiseAbs().maxCoeff(), 1e-11 * exact.cwiseAbs().maxCoeff());
  }
}

TEST(Elasticity, NodalVolumesSumToTheMeshVolume) {
  TetMesh mesh = box_mesh(3, 2, 2, Vec3(3, 4, 5));
  perturb_interior(mesh, 0.1, 1);
  EXPECT_NEAR(nodal_volumes(mesh).sum(), 60.0, 1e-12);
}

TEST(DofMap, RestrictIsTheTransposeOfExpand) {
  const TetMesh mesh = box_mesh(2, 2, 2, Vec3(2, 2, 2));
  DofMap dofs(mesh.num_nodes());
  dofs.fix_normal(3, Vec3(1, 2, 3).normalized());
  dofs.fix_normal(7, Vec3(-1, 0.5, 0).normalized());
  dofs.fix_all(5);
  dofs.finalise();
  EXPECT_EQ(dofs.num_unknowns(), 3 * mesh.num_nodes() - 5);
  std::srand(5);
  const VecX q = VecX::Random(dofs.num_unknowns());
  const Points f = Points::Random(3, mesh.num_nodes());
  const Points u = dofs.expand(q);
  ASSERT_GT(std::abs(q.dot(dofs.restrict_to(f))), 1e-3);
  EXPECT_NEAR(u.cwiseProduct(f).sum(), q.dot(dofs.restrict_to(f)), 1e-12);
  EXPECT_NEAR(u.col(3).dot(Vec3(1, 2, 3)), 0.0, 1e-14);
  EXPECT_TRUE(u.col(5).isZero(0.0));
}

TEST(DofMap, SeveralFieldsAreExpandedAndRestrictedAsOne) {
  DofMap dofs(4);
  dofs.fix_normal(0, Vec3(1.0, 2.0, -2.0) / 3.0);
  dofs.fix_plane(1, Vec3(0.6, 0.8, 0.0), Vec3(-0.8, 0.6, 0.0));
  dofs.fix_all(2);
  dofs.finalise();
  std::srand(4);
  const Eigen::MatrixXd q = Eigen::MatrixXd::Random(5, dofs.num_unknowns());
  const Eigen::MatrixXd f = Eigen::MatrixXd::Random(5, 12);
  Eigen::MatrixXd u, restricted;
  dofs.expand_rows(q, u);
  dofs.restrict_rows(f, restricted);
  for (Eigen::Index j = 0; j < 5; ++j) {
    const Points one = dofs.expand(VecX(q.row(j).transpose()));
    EXPECT_LT((u.row(j).transpose() - one.reshaped()).norm(), 1e-15) << j;
    const VecX field = f.row(j).transpose();
    const VecX expected = dofs.restrict_to(Points(Eigen::Map<const Points>(field.data(), 3, 4)));
    EXPECT_LT((restricted.row(j).transpose() - expected).norm(), 1e-15) << j;
  }
}

}  // namespace
}  // namespace brainshift::fem
