// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/moving_surface.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>

#include "common/core/random.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/results.hpp"

namespace brainshift::geometry {
namespace {

TriangleSurface egg() { return ellipsoid_surface(Vec3(3, -2, 8), Vec3(16, 13, 11), 2.0); }

// Shifted by 20 mm, turned by 17 degrees, stretched by a tenth and bent.
Points deformed(const Points& x) {
  const Mat3 turn = Eigen::AngleAxisd(0.3, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  const Mat3 stretch = Vec3(1.1, 0.95, 1.0).asDiagonal();
  Points moved = (turn * stretch * x).colwise() + Vec3(12, -9, 13);
  moved.row(2) += 1e-2 * x.row(0).array().square().matrix();
  return moved;
}

// The place on the surface as it is now, mm.
Vec3 moved_point(const TriangleSurface& now, const SurfacePlace& place) {
  const auto corners = now.triangles.col(place.triangle);
  return place.weights[0] * now.vertices.col(corners[0]) +
         place.weights[1] * now.vertices.col(corners[1]) +
         place.weights[2] * now.vertices.col(corners[2]);
}

// Twenty points around each vertex, up to `most_mm` away.
Points around(const Points& vertices, double most_mm) {
  Random random(7);
  Points points(3, 20 * vertices.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    points.col(i) = vertices.col(i / 20) + most_mm * random.uniform() * random.direction();
  }
  return points;
}

TEST(MovedSurface, HasTheClosestPointsOfATreeOfItsOwn) {
  const TriangleSurface at_rest = egg();
  const auto surface = value_or_fail(MovingSurface::build(at_rest));
  const Points vertices = deformed(at_rest.vertices);
  const MovedSurface moved(surface, vertices);
  const auto tree = value_or_fail(ClosestPointIndex::build({vertices, at_rest.triangles}));
  const Points queries = around(vertices, 4.0);
  for (const auto query : queries.colwise()) {
    const SurfacePlace place = moved.closest(query);
    const ClosestPoint expected = tree.closest(query);
    ASSERT_NEAR(place.distance_mm, expected.distance_mm, 1e-9);
    ASSERT_LT((moved_point({vertices, at_rest.triangles}, place) - expected.point).norm(), 1e-6);
    EXPECT_NEAR(place.weights.sum(), 1.0, 1e-12);
    EXPECT_GE(place.weights.minCoeff(), -1e-9);
  }
}

TEST(MovedSurface, RemembersWhereAPlaceCameFrom) {
  const TriangleSurface at_rest = egg();
  const auto surface = value_or_fail(MovingSurface::build(at_rest));
  const Points vertices = at_rest.vertices.colwise() + Vec3(5, 6, -7);
  const MovedSurface moved(surface, vertices);
  const Points queries = around(at_rest.vertices, 3.0);
  for (const auto query : queries.colwise()) {
    const SurfacePlace place = moved.closest(query);
    const Vec3 now = moved_point({vertices, at_rest.triangles}, place);
    EXPECT_LT((now - moved.point_at_rest(place) - Vec3(5, 6, -7)).norm(), 1e-9);
  }
}

// The facets of this ball lean by up to 4 degrees; its interpolated normals by far less.
TEST(MovedSurface, NormalsOfABallAreRadial) {
  const TriangleSurface ball = ellipsoid_surface(Vec3::Zero(), Vec3::Constant(14), 1.5);
  const auto surface = value_or_fail(MovingSurface::build(ball));
  const MovedSurface moved(surface, ball.vertices);
  double interpolated = 0.0, facets = 0.0;
  const Points queries = around(ball.vertices, 1.0);
  for (const auto query : queries.colwise()) {
    const SurfacePlace place = moved.closest(query);
    const Vec3 radial = moved_point(ball, place).normalized();
    const Vec3 n = moved.normal(place);
    EXPECT_NEAR(n.norm(), 1.0, 1e-12);
    EXPECT_GT(n.dot(radial), 0.0);
    interpolated = std::max(interpolated, n.cross(radial).norm());
    facets =
        std::max(facets, surface.at_rest().triangle_normal(place.triangle).cross(radial).norm());
  }
  EXPECT_GT(facets, 0.03) << "the test shows nothing";
  EXPECT_LT(interpolated, 0.1 * facets);
}

// Two triangles over the unit square, and one that touches the square's corner (1, 1) only.
TriangleSurface kite() {
  TriangleSurface surface;
  surface.vertices.resize(3, 6);
  surface.vertices << 0, 1, 1, 0, 2, 1.5, 0, 0, 1, 1, 1.5, 2, 0, 0, 0, 0, 0, 0;
  surface.triangles.resize(3, 3);
  surface.triangles << 0, 0, 2, 1, 2, 4, 2, 3, 5;
  return surface;
}

TEST(MovedSurface, KnowsItsRim) {
  const auto surface = value_or_fail(MovingSurface::build(kite()));
  const MovedSurface moved(surface, kite().vertices);
  const auto on_rim = [&](double x, double y) {
    return moved.on_rim(moved.closest(Vec3(x, y, 0.3)));
  };
  EXPECT_FALSE(on_rim(0.4, 0.7));
  EXPECT_FALSE(on_rim(0.5, 0.5)) << "an inner edge";
  EXPECT_TRUE(on_rim(-0.2, 0.5));
  EXPECT_TRUE(on_rim(0.5, 1.4));
  EXPECT_TRUE(on_rim(-0.2, -0.2)) << "a corner";
}

// A vertex of the rim may be the closest point of a triangle that has no edge of the rim.
TEST(MovedSurface, KnowsARimVertexFromATriangleWithoutRimEdges) {
  const TriangleSurface ball = ellipsoid_surface(Vec3::Zero(), Vec3::Constant(10), 3.0);
  TriangleSurface open = ball;  // without one triangle
  open.triangles = ball.triangles.rightCols(ball.triangles.cols() - 1);
  const auto surface = value_or_fail(MovingSurface::build(open));
  const MovedSurface moved(surface, open.vertices);
  for (const int vertex : ball.triangles.col(0)) {
    EXPECT_TRUE(moved.on_rim(moved.closest(1.2 * ball.vertices.col(vertex))));
  }
  const auto closed = value_or_fail(MovingSurface::build(ball));
  const MovedSurface whole(closed, ball.vertices);
  for (const auto vertex : ball.vertices.colwise()) {
    EXPECT_FALSE(whole.on_rim(whole.closest(1.2 * vertex)));
  }
}

TEST(MovedSurface, PassesTrianglesThatTheMotionFlattened) {
  const TriangleSurface at_rest = egg();
  const auto surface = value_or_fail(MovingSurface::build(at_rest));
  Points vertices = at_rest.vertices;
  const auto flat = at_rest.triangles.col(5);
  vertices.col(flat[1]) = vertices.col(flat[0]);
  const MovedSurface moved(surface, vertices);
  const auto tree = value_or_fail(ClosestPointIndex::build({vertices, at_rest.triangles}));
  const Points queries = around(vertices, 1.0);
  for (const auto query : queries.colwise()) {
    ASSERT_NEAR(moved.closest(query).distance_mm, tree.closest(query).distance_mm, 1e-9);
  }
}

TEST(MovingSurface, RefusesWhatHasNoTriangleOrIsNotFinite) {
  EXPECT_EQ(MovingSurface::build({}).error().code, ErrorCode::kEmptySet);
  TriangleSurface broken = kite();
  broken.vertices(1, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(MovingSurface::build(broken).error().code, ErrorCode::kNotFinite);
  broken = kite();
  broken.triangles(0, 0) = 6;
  EXPECT_EQ(MovingSurface::build(broken).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace brainshift::geometry
