// SPDX-License-Identifier: GPL-3.0-or-later
// The surface that points are aligned to, as ICP sees it: distances of many points at once, and
// their gradients.
//
//   r_i = distance of x_i from the surface, mm;   g_i = grad r_i at x_i, no unit
//   triangles  q_i the closest surface point, g_i the direction from q_i to x_i: the triangle's
//              normal (up to sign), at an edge or vertex the one of its normals that points there;
//              exact, about 1 us a point
//   volume     interpolated (geometry/distance_volume.hpp): wrong by hundredths of a millimetre,
//              some 10 ns a point
//
// A view: it refers to the surface, which must outlive it. Calls from several threads are safe.
#pragma once

#include <functional>

#include "common/core/types.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/distance_volume.hpp"

namespace brainshift::registration {

class TargetSurface {
 public:
  // Implicit: align(points, surface, ...) takes either.
  TargetSurface(const geometry::ClosestPointIndex& triangles);
  TargetSurface(const geometry::DistanceVolume& volume);

  // points: m x 3, finite, mm. distances_mm and gradients must have m rows.
  void measure(const geometry::PointRows& points, VecX& distances_mm,
               geometry::PointRows& gradients) const {
    measure_(points, distances_mm, gradients);
  }

 private:
  std::function<void(const geometry::PointRows&, VecX&, geometry::PointRows&)> measure_;
};

}  // namespace brainshift::registration
