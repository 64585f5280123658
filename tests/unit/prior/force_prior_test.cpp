// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/prior/force_prior.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "common/fem/elasticity.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::prior {
namespace {

using test_support::box_mesh;

TEST(WendlandC2, IsOneAtZeroAndVanishesAtItsSupport) {
  EXPECT_DOUBLE_EQ(wendland_c2(0.0, 21.0), 1.0);
  EXPECT_DOUBLE_EQ(wendland_c2(21.0, 21.0), 0.0);
  EXPECT_DOUBLE_EQ(wendland_c2(30.0, 21.0), 0.0);
  EXPECT_DOUBLE_EQ(wendland_c2(10.5, 21.0), 3.0 / 16.0);  // (1/2)^4 * 3
}

// Largest difference of the two formulas: 0.1976 at r = 2.376 L, and never negative. Other
// supports fail: with S = 4 L it is 0.223, with S = 4.4 L 0.174.
TEST(WendlandC2, FallsALittleFasterThanThePapersCorrelation) {
  constexpr double kLength = 5.0;
  double largest = 0.0, at = 0.0;
  for (int k = 0; k <= 3000; ++k) {
    const double r = 0.01 * k;
    const double paper = (1.0 + r / kLength) * std::exp(-r / kLength);
    const double difference = paper - wendland_c2(r, kSupportOverCorrelationLength * kLength);
    EXPECT_GE(difference, 0.0) << "r = " << r;
    if (difference > largest) {
      largest = difference;
      at = r;
    }
  }
  EXPECT_NEAR(largest, 0.1976, 1e-4);
  EXPECT_NEAR(at / kLength, 2.376, 0.01);
}

TEST(ForcePrior, EqualsTheDenseDefinition) {
  TetMesh mesh = box_mesh(3, 3, 3, Vec3(30, 30, 30));
  test_support::perturb_interior(mesh, 2.0, 5);
  const VecX volumes = fem::nodal_volumes(mesh);
  std::srand(8);
  const Eigen::MatrixXd modes = Eigen::MatrixXd::Random(3 * mesh.num_nodes(), 2);
  const double sd = 0.3;
  const double length = 6.0;
  const ForcePrior prior(mesh.nodes, volumes, length, sd, modes);
  const Points w = Points::Random(3, mesh.num_nodes());
  const Points f = prior.apply(w);

  const int n = mesh.num_nodes();
  Points expected = Points::Zero(3, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double r = (mesh.nodes.col(i) - mesh.nodes.col(j)).norm();
      expected.col(i) +=
          sd * sd * volumes[i] * volumes[j] * wendland_c2(r, 4.2 * length) * w.col(j);
    }
  }
  const VecX flat = Eigen::Map<const VecX>(w.data(), w.size());
  const VecX from_modes = modes * (modes.transpose() * flat);
  expected += Eigen::Map<const Points>(from_modes.data(), 3, n);
  ASSERT_GT(expected.norm(), 1.0);
  EXPECT_LT((f - expected).norm(), 1e-13 * expected.norm());
}

TEST(ForcePrior, IsPositiveDefiniteAlsoForLongCorrelation) {
  const TetMesh mesh = box_mesh(4, 4, 4, Vec3(20, 20, 20));
  for (double length : {1.0, 5.0, 8.0}) {
    const ForcePrior prior(mesh.nodes, fem::nodal_volumes(mesh), length, 1.0, {});
    const Eigen::MatrixXd dense(prior.kernel());
    EXPECT_LT((dense - dense.transpose()).norm(), 1e-14 * dense.norm());
    const VecX eigenvalues = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense).eigenvalues();
    EXPECT_GT(eigenvalues[0], 0.0) << "L = " << length;
  }
}

// The variance of the total force on a body is a property of the body, not of its mesh.
TEST(ForcePrior, DoesNotDependOnTheMesh) {
  double variance[2];
  int k = 0;
  for (int cells : {10, 16}) {
    const TetMesh mesh = box_mesh(cells, cells, cells, Vec3(40, 40, 40));
    const ForcePrior prior(mesh.nodes, fem::nodal_volumes(mesh), 6.0, 1e-6, {});
    Points ones = Points::Zero(3, mesh.num_nodes());
    ones.row(0).setOnes();
    variance[k++] = prior.apply(ones).row(0).sum();
  }
  // Trapezoidal quadrature of a kernel of width 25 mm on cells of 4 and 2.5 mm: below 2 %.
  EXPECT_NEAR(variance[0] / variance[1], 1.0, 0.02);
}

}  // namespace
}  // namespace brainshift::prior
