// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "common/fem/elasticity.hpp"
#include "common/geometry/node_choice.hpp"
#include "common/prior/force_prior.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/dense.hpp"

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
    const double difference = paper - wendland_c2(r, ForceKernel::kSupportOverLength * kLength);
    EXPECT_GE(difference, 0.0) << "r = " << r;
    if (difference > largest) {
      largest = difference;
      at = r;
    }
  }
  EXPECT_NEAR(largest, 0.1976, 1e-4);
  EXPECT_NEAR(at / kLength, 2.376, 0.01);
}

Points applied(const ForceKernel& kernel, const Points& w) {
  Points f = Points::Zero(3, w.cols());
  kernel.add_to(w, f);
  return f;
}

// Row and column for each node, from the response to a force on one component of one node.
Eigen::MatrixXd dense_of(const ForceKernel& kernel, const TetMesh& mesh) {
  const int n = mesh.num_nodes();
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(n, 3 * n), forces;
  for (int i = 0; i < n; ++i) unit(i, 3 * i) = 1.0;
  kernel.apply(unit, forces);
  return forces(Eigen::all, Eigen::seqN(0, n, 3));
}

TetMesh crooked_box(int cells, double size_mm) {
  TetMesh mesh = box_mesh(cells, cells, cells, Vec3(size_mm, size_mm, size_mm));
  test_support::perturb_interior(mesh, 2.0, 5);
  return mesh;
}

TEST(ForceKernel, CompactEqualsTheDenseDefinition) {
  const TetMesh mesh = crooked_box(3, 30.0);
  const VecX volumes = fem::nodal_volumes(mesh);
  const double sd = 0.3, length = 6.0;
  const ForceKernel kernel = ForceKernel::compact(mesh.nodes, volumes, length, sd);
  std::srand(8);
  const int n = mesh.num_nodes();
  const Points w = Points::Random(3, n);
  Points expected = Points::Zero(3, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double r = (mesh.nodes.col(i) - mesh.nodes.col(j)).norm();
      expected.col(i) +=
          sd * sd * volumes[i] * volumes[j] * wendland_c2(r, 4.2 * length) * w.col(j);
    }
  }
  ASSERT_GT(expected.norm(), 1.0);
  EXPECT_LT((applied(kernel, w) - expected).norm(), 1e-13 * expected.norm());
}

// With every node a centre the basis is the whole correlation matrix.
TEST(ForceKernel, BasisOverAllNodesIsThePapersCorrelation) {
  const TetMesh mesh = crooked_box(2, 30.0);
  const VecX volumes = fem::nodal_volumes(mesh);
  ASSERT_LE(mesh.num_nodes(), ForceKernel::kFewestCentres);
  const double sd = 0.3, length = 20.0;
  const Eigen::MatrixXd dense = dense_of(ForceKernel::basis(mesh.nodes, volumes, length, sd), mesh);
  for (int i = 0; i < mesh.num_nodes(); ++i) {
    for (int j = 0; j < mesh.num_nodes(); ++j) {
      const double r = (mesh.nodes.col(i) - mesh.nodes.col(j)).norm() / length;
      const double expected = sd * sd * volumes[i] * volumes[j] * (1.0 + r) * std::exp(-r);
      EXPECT_NEAR(dense(i, j), expected, 1e-6 * sd * sd * volumes[i] * volumes[j]);
    }
  }
}

// Between centres a part of the variance is lost; at three centres per cubed length little.
TEST(ForceKernel, BasisKeepsMostOfTheVariance) {
  const TetMesh mesh = box_mesh(10, 10, 10, Vec3(100, 100, 100));
  const VecX volumes = fem::nodal_volumes(mesh);
  for (const double length : {20.0, 60.0}) {
    const VecX kept = dense_of(ForceKernel::basis(mesh.nodes, volumes, length, 1.0), mesh)
                          .diagonal()
                          .cwiseQuotient(volumes.cwiseAbs2());
    EXPECT_LE(kept.maxCoeff(), 1.0 + 1e-6) << length;
    EXPECT_GT(kept.mean(), 0.9) << length;
  }
}

TEST(ForceKernel, AppliesToSeveralFieldsAsToOne) {
  const TetMesh mesh = crooked_box(4, 40.0);
  const VecX volumes = fem::nodal_volumes(mesh);
  std::srand(9);
  const Eigen::MatrixXd w = Eigen::MatrixXd::Random(70, 3 * mesh.num_nodes());
  for (const ForceKernel& kernel : {ForceKernel::compact(mesh.nodes, volumes, 5.0, 0.1),
                                    ForceKernel::basis(mesh.nodes, volumes, 20.0, 0.1)}) {
    Eigen::MatrixXd f;
    kernel.apply(w, f);
    const VecX variance = kernel.variance_along(w);
    for (Eigen::Index j = 0; j < w.rows(); ++j) {
      const VecX field = w.row(j).transpose();
      const Points one = applied(kernel, Eigen::Map<const Points>(field.data(), 3, w.cols() / 3));
      ASSERT_GT(one.norm(), 0.0);
      EXPECT_LT((f.row(j).transpose() - one.reshaped()).norm(), 1e-12 * one.norm());
      EXPECT_NEAR(variance[j], field.dot(one.reshaped()), 1e-12 * variance[j]);
    }
  }
}

TEST(ForceKernel, CompactIsPositiveDefiniteAlsoForLongCorrelation) {
  const TetMesh mesh = box_mesh(4, 4, 4, Vec3(20, 20, 20));
  for (double length : {1.0, 5.0, 8.0}) {
    const Eigen::MatrixXd dense =
        dense_of(ForceKernel::compact(mesh.nodes, fem::nodal_volumes(mesh), length, 1.0), mesh);
    EXPECT_LT((dense - dense.transpose()).norm(), 1e-14 * dense.norm());
    const VecX eigenvalues = test_support::eigenvalues(dense);
    EXPECT_GT(eigenvalues[0], 0.0) << "L = " << length;
  }
}

// The variance of the total force on a body is a property of the body, not of its mesh.
TEST(ForceKernel, DoesNotDependOnTheMesh) {
  for (const bool compact : {true, false}) {
    double variance[2];
    int k = 0;
    for (int cells : {10, 16}) {
      const TetMesh mesh = box_mesh(cells, cells, cells, Vec3(40, 40, 40));
      const VecX volumes = fem::nodal_volumes(mesh);
      const ForceKernel kernel = compact ? ForceKernel::compact(mesh.nodes, volumes, 6.0, 1e-6)
                                         : ForceKernel::basis(mesh.nodes, volumes, 20.0, 1e-6);
      Points ones = Points::Zero(3, mesh.num_nodes());
      ones.row(0).setOnes();
      variance[k++] = applied(kernel, ones).row(0).sum();
    }
    // Trapezoidal quadrature of a kernel of width 25 mm on cells of 4 and 2.5 mm: below 2 %.
    EXPECT_NEAR(variance[0] / variance[1], 1.0, 0.02) << compact;
  }
}

// Near and far are one field's two independent parts, and far ones are small where data come from.
TEST(ForceKernel, NearAndFarSumUpToTheWholeField) {
  const TetMesh mesh = test_support::box_mesh(8, 4, 4, Vec3(160, 60, 60));
  const VecX volumes = fem::nodal_volumes(mesh);
  std::vector<NodeIndex> places;  // the left end
  for (int i = 0; i < mesh.num_nodes(); ++i) {
    if (mesh.nodes(0, i) < 20.0) places.push_back(i);
  }
  const auto parts = ForceKernel::basis_about(mesh.nodes, volumes, 20.0, 0.2, places, 30.0);
  const Eigen::MatrixXd near = dense_of(parts.near, mesh), far = dense_of(parts.far, mesh);
  const Eigen::MatrixXd whole = dense_of(ForceKernel::basis(mesh.nodes, volumes, 20.0, 0.2), mesh);
  EXPECT_LT((near + far - whole).norm(), 1e-6 * whole.norm());
  EXPECT_LT((dense_of(ForceKernel::sum_of(parts.near, parts.far), mesh) - whole).norm(),
            1e-6 * whole.norm());
  for (int i = 0; i < mesh.num_nodes(); ++i) {
    const double share = far(i, i) / whole(i, i);
    if (mesh.nodes(0, i) < 1.0) {
      EXPECT_LT(share, 0.1) << i;
    } else if (mesh.nodes(0, i) > 120.0) {
      EXPECT_GT(share, 0.9) << i;
    }
  }
  // Without a place where data come from, all is far.
  const auto nowhere = ForceKernel::basis_about(mesh.nodes, volumes, 20.0, 0.2, {}, 30.0);
  EXPECT_EQ(dense_of(nowhere.near, mesh).norm(), 0.0);
}

TEST(ForcePrior, IsTheSumOfItsKernelsAndModes) {
  const TetMesh mesh = test_support::box_mesh(3, 3, 3, Vec3(30, 30, 30));
  const VecX volumes = fem::nodal_volumes(mesh);
  std::srand(8);
  LoadModes modes;
  modes.columns = Eigen::MatrixXd::Random(3 * mesh.num_nodes(), 2);
  modes.of_part[0] = 2;
  const ForcePrior prior({ForceKernel::compact(mesh.nodes, volumes, 6.0, 0.3),
                          ForceKernel::basis(mesh.nodes, volumes, 20.0, 0.2),
                          ForceKernel::basis(mesh.nodes, volumes, 60.0, 0.1),
                          ForceKernel::basis(mesh.nodes, volumes, 40.0, 0.15)},
                         modes);
  const Points w = Points::Random(3, mesh.num_nodes());
  const Points f = prior.apply(w);
  const Eigen::MatrixXd dense = dense_of(prior.kernel(0), mesh) + dense_of(prior.kernel(1), mesh) +
                                dense_of(prior.kernel(2), mesh) + dense_of(prior.kernel(3), mesh);
  const Points remainders = w * dense;  // symmetric
  ASSERT_GT(remainders.norm(), 1.0);
  const VecX from_modes = modes.columns * (modes.columns.transpose() * w.reshaped());
  const VecX expected = remainders.reshaped() + from_modes;
  EXPECT_LT((f.reshaped() - expected).norm(), 1e-12 * expected.norm());
}

}  // namespace
}  // namespace brainshift::prior
