// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/deformation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/random.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::fem {
namespace {

using test_support::box_mesh;

Points random_displacement(const TetMesh& mesh, double size) {
  Random random(5);
  Points u(3, mesh.num_nodes());
  for (Eigen::Index i = 0; i < u.size(); ++i) u(i) = size * random.normal();
  return u;
}

TEST(Deformation, VolumeRatioOfALinearDisplacementIsTheDeterminantOfF) {
  const TetMesh mesh = box_mesh(3, 2, 2, Vec3(30, 20, 20));
  Mat3 gradient;
  gradient << 0.1, 0.2, 0.0, -0.1, 0.05, 0.3, 0.0, 0.1, -0.2;
  const double expected = (Mat3::Identity() + gradient).determinant();
  const Points u = gradient * mesh.nodes;
  const Deformation measured = measure_deformation(mesh, u);
  EXPECT_NEAR(measured.min_volume_ratio, expected, 1e-12);
  EXPECT_EQ(measured.inverted, 0);
  ThreadTeam team(2);
  EXPECT_NEAR(DeformationCheck(mesh.nodes, mesh.tets, team).measure(u).min_volume_ratio, expected,
              1e-4);
}

// Volumes about a node from triple products, node by node.
double least_nodal_ratio(const TetMesh& mesh, const Points& u) {
  double least = std::numeric_limits<double>::infinity();
  for (int node = 0; node < mesh.num_nodes(); ++node) {
    double rest = 0.0, moved = 0.0;
    for (int t = 0; t < mesh.num_tets(); ++t) {
      if ((mesh.tets.col(t).array() != node).all()) continue;
      for (double* sum : {&rest, &moved}) {
        const Points x = sum == &rest ? mesh.nodes : Points(mesh.nodes + u);
        Mat3 edges;
        for (int k = 0; k < 3; ++k) {
          edges.col(k) = x.col(mesh.tets(k + 1, t)) - x.col(mesh.tets(0, t));
        }
        *sum += edges.determinant();
      }
    }
    least = std::min(least, moved / rest);
  }
  return least;
}

TEST(Deformation, NodalVolumeRatioIsThatOfTheVolumeAboutANode) {
  const TetMesh mesh = box_mesh(3, 3, 2, Vec3(30, 30, 20));
  ThreadTeam team(2);
  DeformationCheck check(mesh.nodes, mesh.tets, team);
  for (const double size : {1.5, 3.0}) {
    const Points u = random_displacement(mesh, size);
    const double expected = least_nodal_ratio(mesh, u);
    ASSERT_LT(measure_deformation(mesh, u).min_volume_ratio, kVolumeInQuestion);
    EXPECT_NEAR(measure_deformation(mesh, u).min_nodal_volume_ratio, expected, 1e-12);
    EXPECT_NEAR(check.measure(u).min_nodal_volume_ratio, expected, 1e-12);
    EXPECT_GT(expected, measure_deformation(mesh, u).min_volume_ratio);
  }
}

TEST(Deformation, ABodyThatIsHalvedLosesHalfTheVolumeAboutEveryNode) {
  const TetMesh mesh = box_mesh(2, 2, 2, Vec3(20, 20, 20));
  Points u = Points::Zero(3, mesh.num_nodes());
  u.row(2) = -0.5 * mesh.nodes.row(2);
  ThreadTeam team(2);
  EXPECT_NEAR(measure_deformation(mesh, u).min_nodal_volume_ratio, 0.5, 1e-12);
  EXPECT_NEAR(DeformationCheck(mesh.nodes, mesh.tets, team).measure(u).min_nodal_volume_ratio, 0.5,
              1e-12);
}

TEST(Deformation, NothingMoreIsComputedWhereNoElementIsInQuestion) {
  const TetMesh mesh = box_mesh(2, 2, 2, Vec3(20, 20, 20));
  const Points u = random_displacement(mesh, 0.1);
  ThreadTeam team(2);
  DeformationCheck check(mesh.nodes, mesh.tets, team);
  for (const Deformation& measured : {measure_deformation(mesh, u), check.measure(u)}) {
    ASSERT_GT(measured.min_volume_ratio, kVolumeInQuestion);
    EXPECT_EQ(measured.min_nodal_volume_ratio, measured.min_volume_ratio);
  }
}

TEST(Deformation, AMirroredBodyIsInvertedEverywhere) {
  const TetMesh mesh = box_mesh(2, 2, 2, Vec3(20, 20, 20));
  Points u = Points::Zero(3, mesh.num_nodes());
  u.row(0) = -2.0 * mesh.nodes.row(0);
  ThreadTeam team(2);
  DeformationCheck check(mesh.nodes, mesh.tets, team);
  EXPECT_EQ(measure_deformation(mesh, u).inverted, mesh.num_tets());
  EXPECT_EQ(check.measure(u).inverted, mesh.num_tets());
  EXPECT_DOUBLE_EQ(check.measure(u).min_volume_ratio, -1.0);
}

TEST(Deformation, SinglePrecisionFindsExactlyTheElementsThatDoublePrecisionFinds) {
  const TetMesh mesh = box_mesh(6, 6, 6, Vec3(60, 60, 60));
  ThreadTeam team(2);
  DeformationCheck check(mesh.nodes, mesh.tets, team);
  for (const double size : {0.1, 1.5, 3.0, 8.0}) {
    const Points u = random_displacement(mesh, size);
    const Deformation exact = measure_deformation(mesh, u), quick = check.measure(u);
    EXPECT_EQ(quick.inverted, exact.inverted) << size;
    EXPECT_NEAR(quick.min_volume_ratio, exact.min_volume_ratio,
                1e-5 * std::abs(exact.min_volume_ratio));
    EXPECT_EQ(quick.worst_tet, exact.worst_tet);
  }
  EXPECT_GT(check.measure(random_displacement(mesh, 3.0)).inverted, 0);
}

// Heights of 1e-6 mm vanish in single precision.
TEST(Deformation, FlatElementsAreLookedAtInDoublePrecision) {
  TetMesh mesh;
  mesh.nodes.resize(3, 5);
  mesh.nodes << 0, 50, 0, 10, 10, 0, 0, 50, 10, 10, 0, 0, 0, 1e-6, -40;
  mesh.tets.resize(4, 2);
  mesh.tets << 0, 0, 1, 2, 2, 1, 3, 4;
  Points u = Points::Zero(3, 5);
  ThreadTeam team(1);
  DeformationCheck check(mesh.nodes, mesh.tets, team);
  EXPECT_EQ(check.measure(u).inverted, 0);
  u(2, 3) = -1.5e-6;  // through the base
  EXPECT_EQ(measure_deformation(mesh, u).inverted, 1);
  EXPECT_EQ(check.measure(u).inverted, 1);
  EXPECT_EQ(check.measure(u).worst_tet, 0);
}

TEST(Deformation, ADisplacementThatIsNotFiniteIsNeverUpright) {
  const TetMesh mesh = box_mesh(2, 2, 2, Vec3(20, 20, 20));
  ThreadTeam team(2);
  DeformationCheck check(mesh.nodes, mesh.tets, team);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Points u = Points::Zero(3, mesh.num_nodes());
    u(1, 13) = bad;
    EXPECT_GT(check.measure(u).inverted, 0);
    EXPECT_TRUE(std::isnan(check.measure(u).min_volume_ratio));
    EXPECT_TRUE(std::isnan(measure_deformation(mesh, u).min_volume_ratio));
  }
}

}  // namespace
}  // namespace brainshift::fem
