// SPDX-License-Identifier: GPL-3.0-or-later
// Closest points on a triangle surface whose vertices move: one index, of the surface at rest,
// serves every deformation.
//
// The search begins where the surface at rest is closest to the query shifted back by the mean
// motion of the vertices. From there it walks: of all triangles that share a corner with the
// present one, it goes to that whose closest point lies nearest to the query, until none lies
// nearer. The end is a local minimum of the distance. It is the closest point of all where the
// query lies nearer to the surface than the surface's radius of curvature and its thickness, and
// the deformation turns the surface by less than a right angle.
//
// A query takes about two microseconds. A tree of its own for every deformation, as
// closest_point.hpp builds it, would take milliseconds.
#pragma once

#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/geometry/closest_point.hpp"

namespace brainshift::geometry {

// A material point of a triangle surface: it keeps its triangle and weights when vertices move.
struct SurfacePlace {
  int triangle = -1;
  Vec3 weights = Vec3::Zero();  // of the triangle's corners; sum 1
  double distance_mm = 0.0;     // from the query; infinite when no triangle there has an area
};

class MovingSurface {
 public:
  // Errors as ClosestPointIndex::build. Copies the surface.
  static Result<MovingSurface> build(const TriangleSurface& at_rest);

  const ClosestPointIndex& at_rest() const { return at_rest_; }

 private:
  friend class MovedSurface;
  explicit MovingSurface(ClosestPointIndex at_rest);

  ClosestPointIndex at_rest_;
  // Triangles that meet at vertex v: around_[first_[v]] to before around_[first_[v + 1]].
  std::vector<int> first_, around_;
  std::vector<char> rim_edge_;    // 3 per triangle: edge k, from corner k to k + 1, is of no other
  std::vector<char> rim_vertex_;  // per vertex: it ends such an edge
};

// The surface with its vertices where they are now.
class MovedSurface {
 public:
  // A view of `surface`, which must outlive it. vertices: 3 x n, mm, finite.
  MovedSurface(const MovingSurface& surface, Points vertices);

  // Precondition: the query is finite.
  SurfacePlace closest(const Vec3& query) const;
  // The place at rest, mm.
  Vec3 point_at_rest(const SurfacePlace& place) const;
  // Unit outward normal, interpolated between those of the corners (area-weighted means of their
  // triangles). It changes continuously along the surface; the normal of a triangle does not, and
  // would show rotations of a sphere by its facets.
  Vec3 normal(const SurfacePlace& place) const;
  // Does the place lie on an edge that only one triangle has? A query whose closest point lies
  // there is beside the surface rather than over it.
  bool on_rim(const SurfacePlace& place) const;

 private:
  SurfacePlace closest_on(int triangle, const Vec3& query) const;
  Vec3 interpolated(const SurfacePlace& place, const Points& values) const;

  const MovingSurface& surface_;
  TriangleSurface moved_;
  Points normals_;    // at the vertices
  Vec3 mean_motion_;  // of the vertices, mm
};

}  // namespace brainshift::geometry
