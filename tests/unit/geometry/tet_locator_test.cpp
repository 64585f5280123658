// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/tet_locator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/dense.hpp"

namespace brainshift::geometry {
namespace {

using test_support::box_mesh;

Vec3 described(const TetMesh& mesh, const TetLocation& location) {
  Vec3 x = Vec3::Zero();
  for (int k = 0; k < 4; ++k) x += location.weights[k] * mesh.nodes.col(location.nodes[k]);
  return x;
}

Eigen::Vector4d barycentric(const TetMesh& mesh, int tet, const Vec3& x) {
  Eigen::Matrix4d system;
  for (int k = 0; k < 4; ++k) system.col(k) << mesh.nodes.col(mesh.tets(k, tet)), 1.0;
  return test_support::solve(system, x.homogeneous());
}

class LocatedPoints {
 public:
  Vec3 in_box(const Vec3& low, const Vec3& high) {
    return low + Vec3(uniform(), uniform(), uniform()).cwiseProduct(high - low);
  }

 private:
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1.0p-53; }
  std::mt19937_64 random_{5};
};

const Vec3 kLow(-10, 20, 5), kHigh(2, 28, 15);

TEST(TetLocator, FindsTheHoldingTetrahedronAsBruteForceDoes) {
  const TetMesh mesh = box_mesh(kLow, kHigh, 5, 0.15);
  const TetLocator locator(mesh);
  LocatedPoints random;
  for (int i = 0; i < 300; ++i) {
    const Vec3 x = random.in_box(kLow, kHigh);
    const TetLocation found = locator.locate(x);
    int expected = -1;
    for (int t = 0; t < mesh.num_tets() && expected < 0; ++t)
      if (barycentric(mesh, t, x).minCoeff() > 0.0) expected = t;
    ASSERT_GE(expected, 0);
    EXPECT_EQ(found.tet, expected);
    EXPECT_EQ(found.nodes, mesh.tets.col(expected));
    EXPECT_LT((found.weights - barycentric(mesh, expected, x)).norm(), 1e-12);
    EXPECT_EQ(found.distance_mm, 0.0);
  }
}

TEST(TetLocator, WeightsReproduceLinearFields) {
  const TetMesh mesh = box_mesh(kLow, kHigh, 5, 0.15);
  const TetLocator locator(mesh);
  const Vec3 gradient(0.3, -1.2, 0.7);
  LocatedPoints random;
  for (int i = 0; i < 300; ++i) {
    const Vec3 x = random.in_box(kLow, kHigh);
    const TetLocation found = locator.locate(x);
    EXPECT_NEAR(gradient.dot(described(mesh, found)), gradient.dot(x), 1e-11);
    EXPECT_NEAR(found.weights.sum(), 1.0, 1e-14);
  }
}

TEST(TetLocator, NodesEdgesAndFacesAreInside) {
  const TetMesh mesh = box_mesh(kLow, kHigh, 4, 0.15);
  const TetLocator locator(mesh);
  const auto expect_inside = [&](const Vec3& x) {
    const TetLocation found = locator.locate(x);
    ASSERT_GE(found.tet, 0);
    EXPECT_LT((described(mesh, found) - x).norm(), 1e-9);
    EXPECT_GE(found.weights.minCoeff(), 0.0);
    EXPECT_LT(found.distance_mm, 1e-9);
  };
  for (int n = 0; n < mesh.num_nodes(); ++n) expect_inside(mesh.nodes.col(n));
  for (const auto& tet : mesh.tets.colwise()) {
    expect_inside((mesh.nodes.col(tet[0]) + mesh.nodes.col(tet[1])) / 2.0);
    expect_inside((mesh.nodes.col(tet[0]) + mesh.nodes.col(tet[1]) + mesh.nodes.col(tet[3])) / 3.0);
  }
}

TEST(TetLocator, OutsideDescribesTheClosestPointOfTheMesh) {
  const TetMesh mesh = box_mesh(kLow, kHigh, 4, 0.15);
  const TetLocator locator(mesh);
  LocatedPoints random;
  int outside = 0;
  for (int i = 0; i < 500; ++i) {
    const Vec3 x = random.in_box(kLow - Vec3::Constant(6), kHigh + Vec3::Constant(6));
    const Vec3 clamped = x.cwiseMax(kLow).cwiseMin(kHigh);
    if (clamped == x) continue;
    ++outside;
    const TetLocation found = locator.locate(x);
    EXPECT_LT((described(mesh, found) - clamped).norm(), 1e-10);
    EXPECT_NEAR(found.distance_mm, (x - clamped).norm(), 1e-10);
    EXPECT_GE(found.weights.minCoeff(), 0.0);
    EXPECT_NEAR(found.weights.sum(), 1.0, 1e-14);
    EXPECT_EQ(found.nodes, mesh.tets.col(found.tet));
  }
  EXPECT_GT(outside, 100);
}

TEST(TetLocator, InsideAConcavityIsOutsideTheMesh) {
  // An L: the box without its quarter x > 0.5, y > 0.5. The bounding box holds the gap.
  TetMesh mesh = box_mesh(Vec3::Zero(), Vec3::Ones(), 4);
  int kept = 0;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    Vec3 centre = Vec3::Zero();
    for (int k = 0; k < 4; ++k) centre += mesh.nodes.col(mesh.tets(k, t)) / 4.0;
    if (centre.x() < 0.5 || centre.y() < 0.5) mesh.tets.col(kept++) = mesh.tets.col(t);
  }
  mesh.tets.conservativeResize(4, kept);
  const TetLocator locator(mesh);
  const TetLocation found = locator.locate(Vec3(0.9, 0.6, 0.3));
  EXPECT_LT((described(mesh, found) - Vec3(0.9, 0.5, 0.3)).norm(), 1e-12);
  EXPECT_NEAR(found.distance_mm, 0.1, 1e-12);
  EXPECT_EQ(locator.locate(Vec3(0.4, 0.9, 0.3)).distance_mm, 0.0);
}

TEST(TetLocator, WorksForVeryDifferentSizesOfTetrahedra) {
  // Cubed coordinates: edges from 1/512 to 0.3 of the box.
  TetMesh mesh = box_mesh(Vec3::Zero(), Vec3::Ones(), 8);
  mesh.nodes = mesh.nodes.array().cube();
  const TetLocator locator(mesh);
  LocatedPoints random;
  for (int i = 0; i < 300; ++i) {
    const Vec3 x = random.in_box(Vec3::Zero(), Vec3::Ones()).array().cube();
    const TetLocation found = locator.locate(x);
    EXPECT_EQ(found.distance_mm, 0.0);
    EXPECT_LT((described(mesh, found) - x).norm(), 1e-12);
  }
}

TEST(TetLocator, AnswersFarQueries) {
  const TetMesh mesh = box_mesh(kLow, kHigh, 3);
  const TetLocation found = TetLocator(mesh).locate(Vec3(1e6, 24, 10));
  EXPECT_NEAR(found.distance_mm, 1e6 - 2.0, 1e-6);
  EXPECT_NEAR(described(mesh, found).x(), 2.0, 1e-9);
}

TEST(TetLocator, ReportsThatThereIsNoAnswer) {
  const TetLocator locator(box_mesh(kLow, kHigh, 2));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Vec3& x : {Vec3(nan, 0, 0), Vec3(0, std::numeric_limits<double>::infinity(), 0)}) {
    EXPECT_EQ(locator.locate(x).tet, -1);
    EXPECT_TRUE(std::isinf(locator.locate(x).distance_mm));
  }
  EXPECT_EQ(TetLocator(TetMesh{}).locate(Vec3::Zero()).tet, -1);
}

TEST(TetLocator, SurvivesBeingMoved) {
  const TetMesh mesh = box_mesh(kLow, kHigh, 2);
  TetLocator first(mesh);
  const TetLocator second = std::move(first);
  EXPECT_EQ(second.locate(Vec3(0, 24, 10)).distance_mm, 0.0);
}

}  // namespace
}  // namespace brainshift::geometry
