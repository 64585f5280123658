// SPDX-License-Identifier: GPL-3.0-or-later
// Closest point of one triangle.
#pragma once

#include "common/core/types.hpp"

namespace brainshift::geometry {

// A triangle with an area: corner a, two edges, and the products that every query needs.
struct TriangleFrame {
  Vec3 a, ab, ac;
  double ab_ab, ab_ac, ac_ac, determinant;

  TriangleFrame(const Vec3& corner, const Vec3& b, const Vec3& c);
};

// The point of the triangle closest to x. It is the foot of the perpendicular on the triangle's
// plane if that lies inside the triangle, otherwise the nearest of the closest points of the
// edges.
Vec3 closest_on_triangle(const TriangleFrame& triangle, const Vec3& x);

}  // namespace brainshift::geometry
