// SPDX-License-Identifier: GPL-3.0-or-later
// Closest point on a triangle surface, by an AABB tree built once (CGAL). Queries are
// thread-safe.
//
// Triangles without area are ignored: their points lie on their neighbours' edges.
#pragma once

#include <memory>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
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

struct ClosestPoint {
  Vec3 point = Vec3::Zero();
  int triangle = -1;
  double distance_mm = 0.0;
};

class ClosestPointIndex {
 public:
  // kEmptySet: the surface has no triangle, or none with an area. kNotFinite: a vertex is not
  // finite. kInvalidArgument: a triangle names a vertex that does not exist. Copies the surface.
  static Result<ClosestPointIndex> build(const TriangleSurface& surface);
  ClosestPointIndex(ClosestPointIndex&&) noexcept;
  ClosestPointIndex& operator=(ClosestPointIndex&&) noexcept;
  ~ClosestPointIndex();

  // Precondition: the query is finite. On an edge or vertex: any of the triangles that meet
  // there.
  ClosestPoint closest(const Vec3& query) const;
  const TriangleSurface& surface() const;
  // Unit outward normal of a triangle.
  Vec3 triangle_normal(int triangle) const;
  // Unit outward normal at a closest point: of the triangle; of both triangles at an edge (mean);
  // or of all triangles at a vertex (mean weighted by angle). The sign of its product with
  // (query - point) tells inside from outside, also at edges and vertices, where the normal of
  // one triangle may not (Baerentzen & Aanaes 2005).
  Vec3 pseudo_normal(const ClosestPoint& closest) const;
  // True when the query lies inside the closed surface: majority over three rays of an odd number
  // of crossings. On the surface itself the answer may be either.
  bool contains(const Vec3& query) const;

 private:
  struct Impl;
  explicit ClosestPointIndex(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::geometry
