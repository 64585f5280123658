// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/triangle_distance.hpp"

#include <gtest/gtest.h>

#include "common/core/random.hpp"
#include "common/geometry/closest_point.hpp"

namespace brainshift::geometry {
namespace {

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
