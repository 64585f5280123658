// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/surface_distances.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "common/core/random.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/results.hpp"

namespace brainshift::registration {
namespace {

geometry::ClosestPointIndex cloud_index_of(const TriangleSurface& surface) {
  return value_or_fail(geometry::ClosestPointIndex::build(surface));
}

// The square [0, 10]^2 in z = 2 with its outward side up.
TriangleSurface plate() {
  TriangleSurface surface;
  surface.vertices.resize(3, 4);
  surface.vertices << 0, 10, 10, 0, 0, 0, 10, 10, 2, 2, 2, 2;
  surface.triangles.resize(3, 2);
  surface.triangles << 0, 0, 1, 2, 2, 3;
  return surface;
}

TEST(Cppd, IsNegativeOutsideAndPositiveInsideAPlate) {
  Points nodes(3, 4);
  nodes << 4, 4, 5, 5,  //
      3, 3, 5, 5,       // the last two project onto the diagonal edge
      3.5, 1.25, 2.5, 2.0;
  const VecX d = signed_projection_distance(nodes, cloud_index_of(plate()));
  ASSERT_EQ(d.size(), 4);
  EXPECT_NEAR(d[0], -1.5, 1e-14);
  EXPECT_NEAR(d[1], 0.75, 1e-14);
  EXPECT_NEAR(d[2], -0.5, 1e-14);
  EXPECT_NEAR(d[3], 0.0, 1e-14);
}

TEST(Cppd, ChangesSignWithTheOrientationOfTheSurface) {
  TriangleSurface turned = plate();
  turned.triangles.row(0).swap(turned.triangles.row(1));
  const Points above = Vec3(4, 3, 3.5);
  EXPECT_NEAR(signed_projection_distance(above, cloud_index_of(turned))[0], 1.5, 1e-14);
}

TEST(Cppd, OfASphereIsRadiusMinusDistance) {
  const Vec3 centre(10, -20, 30);
  const auto sphere =
      cloud_index_of(geometry::ellipsoid_surface(centre, Vec3::Constant(20.0), 1.0));
  Random random(3);
  Points nodes(3, 200);
  for (int i = 0; i < 200; ++i)
    nodes.col(i) = centre + (18.0 + 4.0 * random.uniform()) * random.direction();
  const VecX d = signed_projection_distance(nodes, sphere);
  int outside = 0;
  for (int i = 0; i < 200; ++i) {
    const double r = (nodes.col(i) - centre).norm();
    EXPECT_NEAR(d[i], 20.0 - r, 0.03);  // facets lie up to edge^2 / (6 R) below the sphere
    outside += d[i] < 0.0;
  }
  EXPECT_GT(outside, 50);
  EXPECT_LT(outside, 150);
}

TEST(Cppd, SignHoldsAboveVertices) {
  // Straight above a vertex any of its triangles may be named.
  const TriangleSurface surface = geometry::ellipsoid_surface(Vec3::Zero(), Vec3(9, 4, 2), 2.0);
  const Points normals = geometry::vertex_normals(surface);
  const auto index = cloud_index_of(surface);
  const VecX above = signed_projection_distance(surface.vertices + 0.3 * normals, index);
  const VecX below = signed_projection_distance(surface.vertices - 0.3 * normals, index);
  EXPECT_LT(above.maxCoeff(), -0.2);
  EXPECT_GT(below.minCoeff(), 0.1);
}

TEST(Cppd, MismatchIsTheMeanMagnitude) {
  const MeanStd m = mismatch((VecX(4) << -1, 1, -3, 3).finished());
  EXPECT_DOUBLE_EQ(m.mean, 2.0);
  EXPECT_DOUBLE_EQ(m.std, std::sqrt(4.0 / 3.0));
}

TEST(Cppd, OfNoNodesIsEmpty) {
  const VecX d = signed_projection_distance(Points(3, 0), cloud_index_of(plate()));
  EXPECT_EQ(d.size(), 0);
  EXPECT_EQ(mismatch(d).mean, 0.0);
}

}  // namespace
}  // namespace brainshift::registration
