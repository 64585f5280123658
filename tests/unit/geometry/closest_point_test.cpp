// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <thread>
#include <vector>

#include "common/core/random.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/box_mesh.hpp"

namespace brainshift::geometry {
namespace {

using test_support::box_mesh;

ClosestPointIndex index_of(const TriangleSurface& surface) {
  auto index = ClosestPointIndex::build(surface);
  EXPECT_TRUE(index.has_value()) << (index ? "" : index.error().message);
  return std::move(*index);
}

class RandomPoints {
 public:
  Vec3 in_cube(double half) { return half * Vec3(symmetric(), symmetric(), symmetric()); }

 private:
  double symmetric() { return static_cast<double>(random_() >> 11) * 0x1.0p-52 - 1.0; }
  std::mt19937_64 random_{42};
};

// Unit cube [-1, 1]^3.
TriangleSurface cube(int cells = 3) {
  return boundary_surface(box_mesh(Vec3::Constant(-1), Vec3::Ones(), cells));
}

Vec3 closest_on_cube(const Vec3& x) {
  if (x.cwiseAbs().maxCoeff() >= 1.0) return x.cwiseMax(-1.0).cwiseMin(1.0);
  int axis = 0;
  x.cwiseAbs().maxCoeff(&axis);
  Vec3 y = x;
  y[axis] = x[axis] > 0.0 ? 1.0 : -1.0;
  return y;
}

// Distance by plain minimisation over all triangles, each by its seven regions.
double brute_force_distance(const TriangleSurface& surface, const Vec3& x) {
  double best = std::numeric_limits<double>::infinity();
  for (const auto& t : surface.triangles.colwise()) {
    const Vec3 corner[3] = {surface.vertices.col(t[0]), surface.vertices.col(t[1]),
                            surface.vertices.col(t[2])};
    const Vec3 n = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
    bool within = true;
    for (int k = 0; k < 3; ++k) {
      const Vec3 a = corner[k], e = corner[(k + 1) % 3] - a;
      within = within && n.dot(e.cross(x - a)) >= 0.0;
      const double s = std::clamp(e.dot(x - a) / e.squaredNorm(), 0.0, 1.0);
      best = std::min(best, (x - a - s * e).norm());
    }
    if (within) best = std::min(best, std::abs(n.dot(x - corner[0])));
  }
  return best;
}

TEST(ClosestPointIndex, FindsTheClosestPointOfACube) {
  const ClosestPointIndex index = index_of(cube());
  RandomPoints random;
  for (int i = 0; i < 500; ++i) {
    const Vec3 x = random.in_cube(2.0);
    const ClosestPoint closest = index.closest(x);
    EXPECT_LT((closest.point - closest_on_cube(x)).norm(), 1e-12);
    EXPECT_NEAR(closest.distance_mm, (x - closest_on_cube(x)).norm(), 1e-12);
  }
}

TEST(ClosestPointIndex, AgreesWithBruteForceOnACurvedSurface) {
  TriangleSurface surface = ellipsoid_surface(Vec3(1, 2, 3), Vec3(9, 5, 3), 1.5);
  for (auto vertex : surface.vertices.colwise()) vertex.z() += 0.5 * std::sin(vertex.x());
  const ClosestPointIndex index = index_of(surface);
  RandomPoints random;
  for (int i = 0; i < 300; ++i) {
    const Vec3 x = random.in_cube(14.0);
    const ClosestPoint closest = index.closest(x);
    EXPECT_NEAR(closest.distance_mm, brute_force_distance(surface, x), 1e-10);
    // The point lies in the plane of the triangle that is named.
    const Vec3 a = surface.vertices.col(surface.triangles(0, closest.triangle));
    EXPECT_NEAR(index.triangle_normal(closest.triangle).dot(closest.point - a), 0.0, 1e-10);
  }
}

TEST(ClosestPointIndex, NormalsPointOutwards) {
  const TriangleSurface surface = cube();
  const ClosestPointIndex index = index_of(surface);
  for (int t = 0; t < surface.num_triangles(); ++t) {
    Vec3 centre = Vec3::Zero();
    for (int k = 0; k < 3; ++k) centre += surface.vertices.col(surface.triangles(k, t)) / 3.0;
    int axis = 0;
    centre.cwiseAbs().maxCoeff(&axis);
    Vec3 expected = Vec3::Zero();
    expected[axis] = centre[axis] > 0.0 ? 1.0 : -1.0;
    EXPECT_LT((index.triangle_normal(t) - expected).norm(), 1e-14);
  }
}

TEST(ClosestPointIndex, PseudoNormalsOfACube) {
  const ClosestPointIndex index = index_of(cube());
  const auto normal_towards = [&](const Vec3& x) { return index.pseudo_normal(index.closest(x)); };
  EXPECT_LT((normal_towards(Vec3(0.1, 0.2, 3)) - Vec3(0, 0, 1)).norm(), 1e-12);
  EXPECT_LT((normal_towards(Vec3(0.1, 2, 2)) - Vec3(0, 1, 1).normalized()).norm(), 1e-12);
  // Weighted by angle the three sides count alike, however many triangles each has at the corner.
  EXPECT_LT((normal_towards(Vec3(2, 2, 2)) - Vec3(1, 1, 1).normalized()).norm(), 1e-12);
  EXPECT_LT((normal_towards(Vec3(-2, 2, 2)) - Vec3(-1, 1, 1).normalized()).norm(), 1e-12);
}

TEST(ClosestPointIndex, PseudoNormalTellsInsideFromOutside) {
  // A sharp wedge: single triangles' normals give the wrong sign near its edge, pseudo-normals
  // never.
  TriangleSurface wedge;
  wedge.vertices.resize(3, 6);
  wedge.vertices << 0, 0, 5, 5, 5, 5,  //
      -4, 4, -4, 4, -4, 4,             //
      0, 0, 0.5, 0.5, -0.5, -0.5;
  wedge.triangles.resize(3, 8);
  wedge.triangles.transpose() << 0, 2, 1, 1, 2, 3, 0, 1, 4, 1, 5, 4, 2, 4, 3, 3, 4, 5, 0, 4, 2, 1,
      3, 5;
  if (enclosed_volume(wedge) < 0.0) wedge.triangles.row(0).swap(wedge.triangles.row(1));
  ASSERT_TRUE(is_closed(wedge));
  const ClosestPointIndex index = index_of(wedge);
  RandomPoints random;
  int inside = 0, misled = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 x = random.in_cube(5.5);
    const bool is_inside = x.x() < 5.0 && std::abs(x.y()) < 4.0 && std::abs(x.z()) < 0.1 * x.x();
    const ClosestPoint closest = index.closest(x);
    EXPECT_EQ(index.pseudo_normal(closest).dot(x - closest.point) < 0.0, is_inside);
    EXPECT_EQ(index.contains(x), is_inside);
    misled += (index.triangle_normal(closest.triangle).dot(x - closest.point) < 0.0) != is_inside;
    inside += is_inside;
  }
  EXPECT_GT(inside, 10);
  EXPECT_GT(misled, 10);  // else the case is too easy
}

TEST(ClosestPointIndex, ContainsIsExactForACube) {
  const ClosestPointIndex index = index_of(cube(4));
  RandomPoints random;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 x = random.in_cube(1.6);
    EXPECT_EQ(index.contains(x), x.cwiseAbs().maxCoeff() < 1.0);
  }
  // From the centre, rays along a diagonal would meet vertices only.
  EXPECT_TRUE(index.contains(Vec3::Zero()));
  EXPECT_FALSE(index.contains(Vec3(std::nan(""), 0, 0)));
}

TEST(ClosestPointIndex, ContainsHandlesCavitiesAndConcavity) {
  // A ball with a ball-shaped cavity, whose surface is turned inwards.
  TriangleSurface outer = ellipsoid_surface(Vec3::Zero(), Vec3::Constant(10), 2.0);
  const TriangleSurface hole = ellipsoid_surface(Vec3(2, 0, 0), Vec3::Constant(5), 2.0);
  const int vertices = outer.num_vertices(), triangles = outer.num_triangles();
  outer.vertices.conservativeResize(3, vertices + hole.num_vertices());
  outer.vertices.rightCols(hole.num_vertices()) = hole.vertices;
  outer.triangles.conservativeResize(3, triangles + hole.num_triangles());
  outer.triangles.rightCols(hole.num_triangles()) =
      hole.triangles.colwise().reverse().array() + vertices;
  const ClosestPointIndex index = index_of(outer);
  RandomPoints random;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 x = random.in_cube(11.0);
    const double to_hole = (x - Vec3(2, 0, 0)).norm();
    // Within 0.2 mm of a sphere its facets decide.
    if (std::abs(x.norm() - 10.0) < 0.2 || std::abs(to_hole - 5.0) < 0.2) continue;
    EXPECT_EQ(index.contains(x), x.norm() < 10.0 && to_hole > 5.0);
  }
}

TEST(ClosestPointIndex, IgnoresTrianglesWithoutArea) {
  TriangleSurface surface = cube();
  const int triangles = surface.num_triangles();
  surface.triangles.conservativeResize(3, triangles + 2);
  surface.triangles.col(triangles) = Eigen::Vector3i(0, 0, 1);
  surface.triangles.col(triangles + 1) = Eigen::Vector3i(2, 2, 2);
  const ClosestPointIndex index = index_of(surface);
  RandomPoints random;
  for (int i = 0; i < 200; ++i) {
    const Vec3 x = random.in_cube(2.0);
    const ClosestPoint closest = index.closest(x);
    EXPECT_LT((closest.point - closest_on_cube(x)).norm(), 1e-12);
    EXPECT_LT(closest.triangle, triangles);
  }
}

TEST(ClosestPointIndex, AnswersAlikeFromSeveralThreads) {
  const ClosestPointIndex index = index_of(ellipsoid_surface(Vec3::Zero(), Vec3(9, 7, 8), 1.0));
  std::vector<Vec3> queries;
  RandomPoints random;
  for (int i = 0; i < 2000; ++i) queries.push_back(random.in_cube(12.0));
  const auto ask = [&](std::vector<double>& answers) {
    for (const Vec3& x : queries)
      answers.push_back(index.closest(x).distance_mm * (index.contains(x) ? -1.0 : 1.0));
  };
  std::vector<double> alone;
  ask(alone);
  std::vector<std::vector<double>> together(4);
  std::vector<std::thread> threads;
  for (auto& answers : together) threads.emplace_back([&] { ask(answers); });
  for (auto& thread : threads) thread.join();
  for (const auto& answers : together) EXPECT_EQ(answers, alone);
}

TEST(ClosestPointIndex, SurvivesBeingMoved) {
  ClosestPointIndex first = index_of(cube());
  ClosestPointIndex second = std::move(first);
  first = index_of(ellipsoid_surface(Vec3::Zero(), Vec3::Ones(), 0.5));
  EXPECT_NEAR(second.closest(Vec3(0, 0, 3)).distance_mm, 2.0, 1e-12);
  EXPECT_EQ(second.surface().num_triangles(), cube().num_triangles());
}

TEST(ClosestPointIndex, RejectsAnInvalidSurface) {
  EXPECT_EQ(ClosestPointIndex::build({}).error().code, ErrorCode::kEmptySet);
  TriangleSurface points_only = cube();
  points_only.triangles.resize(3, 0);
  EXPECT_EQ(ClosestPointIndex::build(points_only).error().code, ErrorCode::kEmptySet);
  TriangleSurface flat = cube();
  flat.vertices.row(0).setZero();
  flat.vertices.row(1).setZero();
  EXPECT_EQ(ClosestPointIndex::build(flat).error().code, ErrorCode::kEmptySet);
  TriangleSurface nan = cube();
  nan.vertices(1, 3) = std::nan("");
  const auto refused = ClosestPointIndex::build(nan);
  EXPECT_EQ(refused.error().code, ErrorCode::kNotFinite);
  EXPECT_NE(refused.error().message.find("vertex 3"), std::string::npos);
  TriangleSurface dangling = cube();
  dangling.triangles(2, 0) = dangling.num_vertices();
  EXPECT_EQ(ClosestPointIndex::build(dangling).error().code, ErrorCode::kInvalidArgument);
}

TEST(ClosestOnTriangle, AgreesWithTheSearchTree) {
  Random random(1);
  const auto anywhere = [&] {
    const double x = random.normal(), y = random.normal(), z = random.normal();
    return Vec3(x, y, z);
  };
  for (int repetition = 0; repetition < 40; ++repetition) {
    TriangleSurface surface;
    surface.vertices.resize(3, 3);
    for (int k = 0; k < 3; ++k) surface.vertices.col(k) = anywhere();
    surface.triangles.resize(3, 1);
    surface.triangles << 0, 1, 2;
    const auto index = ClosestPointIndex::build(surface);
    ASSERT_TRUE(index);
    const TriangleFrame frame(surface.vertices.col(0), surface.vertices.col(1),
                              surface.vertices.col(2));
    for (int i = 0; i < 100; ++i) {
      const Vec3 x = 3.0 * anywhere();
      EXPECT_LT((closest_on_triangle(frame, x) - index->closest(x).point).norm(), 1e-9);
    }
  }
}

}  // namespace
}  // namespace brainshift::geometry
