// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/triangle_distance.hpp"

#include <algorithm>

namespace brainshift::geometry {
namespace {

// Fraction along an edge of the point closest to one whose projection on the edge is `along` of
// length^2.
double clamped(double along, double length_squared) {
  return std::clamp(along / length_squared, 0.0, 1.0);
}

}  // namespace

TriangleFrame::TriangleFrame(const Vec3& corner, const Vec3& b, const Vec3& c)
    : a(corner), ab(b - corner), ac(c - corner), ab_ab(ab.squaredNorm()), ab_ac(ab.dot(ac)) {
  ac_ac = ac.squaredNorm();
  determinant = ab_ab * ac_ac - ab_ac * ab_ac;
}

Vec3 closest_on_triangle(const TriangleFrame& t, const Vec3& x) {
  const Vec3 ax = x - t.a;
  const double ab_ax = t.ab.dot(ax), ac_ax = t.ac.dot(ax);
  // a + u ab + v ac is the foot of the perpendicular (normal equations, times the determinant).
  const double u = t.ac_ac * ab_ax - t.ab_ac * ac_ax;
  const double v = t.ab_ab * ac_ax - t.ab_ac * ab_ax;
  if (u >= 0.0 && v >= 0.0 && u + v <= t.determinant)
    return t.a + (u * t.ab + v * t.ac) / t.determinant;
  const Vec3 on_ab = t.a + clamped(ab_ax, t.ab_ab) * t.ab;
  const Vec3 on_ac = t.a + clamped(ac_ax, t.ac_ac) * t.ac;
  const Vec3 bc = t.ac - t.ab;
  const Vec3 on_bc = t.a + t.ab + clamped(bc.dot(ax - t.ab), bc.squaredNorm()) * bc;
  const double d_ab = (x - on_ab).squaredNorm(), d_ac = (x - on_ac).squaredNorm(),
               d_bc = (x - on_bc).squaredNorm();
  if (d_ab <= d_ac) return d_ab <= d_bc ? on_ab : on_bc;
  return d_ac <= d_bc ? on_ac : on_bc;
}

}  // namespace brainshift::geometry
