// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/surface.hpp"

#include <gtest/gtest.h>

#include "tests/support/results.hpp"
#include "tests/unit/igtl/examples.hpp"

namespace brainshift::igtl {
namespace {

using Triangles = Eigen::Matrix<int, 3, Eigen::Dynamic>;

PolyData square() {
  PolyData data;
  data.points.resize(3, 4);
  data.points << 0.0F, 1.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 1.0F, 0.5F, 0.5F, 0.5F, 0.5F;
  return data;
}

Triangles triangles(std::initializer_list<int> columns) {
  return Eigen::Map<const Triangles>(columns.begin(), 3,
                                     static_cast<Eigen::Index>(columns.size() / 3));
}

TEST(Surface, ASurfaceComesBackFromItsPolyData) {
  TriangleSurface surface;
  surface.vertices = test_example::poly_data().points.cast<double>();
  surface.triangles = triangles({0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3});
  const PolyData data = from_surface(surface);
  EXPECT_TRUE(validate(data));
  EXPECT_EQ(data.polygons.count, 4u);
  const auto back = value_or_fail(to_surface(data));
  EXPECT_EQ(back.vertices, surface.vertices);
  EXPECT_EQ(back.triangles, surface.triangles);
}

TEST(Surface, APolygonBecomesAFan) {
  PolyData data = square();
  data.polygons.add({0, 1, 2, 3});
  const auto surface = value_or_fail(to_surface(data));
  EXPECT_EQ(surface.triangles, triangles({0, 1, 2, 0, 2, 3}));
}

// Both triangles of the strip 0 1 3 2 of a square face the same way.
TEST(Surface, AStripKeepsItsOrientation) {
  PolyData data = square();
  data.triangle_strips.add({0, 1, 3, 2});
  const auto surface = value_or_fail(to_surface(data));
  ASSERT_EQ(surface.num_triangles(), 2);
  for (int t = 0; t < 2; ++t) {
    const auto corner = [&](int i) -> Vec3 {
      return surface.vertices.col(surface.triangles(i, t));
    };
    const Vec3 normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    EXPECT_EQ(normal, Vec3(0.0, 0.0, 1.0));
  }
}

TEST(Surface, TrianglesThatNameAPointTwiceAreLeftOut) {
  PolyData data = square();
  data.triangle_strips.add({0, 1, 2, 2, 3});
  data.polygons.add({1, 1, 2});
  const auto surface = value_or_fail(to_surface(data));
  EXPECT_EQ(surface.triangles, triangles({0, 1, 2}));
}

TEST(Surface, PointsAndLinesAloneAreNoSurface) {
  PolyData data = square();
  data.vertices.add({0});
  data.lines.add({0, 1, 2});
  data.polygons.add({0, 1});
  data.polygons.add({});
  refusal_of(to_surface(data), ErrorCode::kEmptySet);
}

}  // namespace
}  // namespace brainshift::igtl
