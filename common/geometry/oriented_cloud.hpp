// SPDX-License-Identifier: GPL-3.0-or-later
// OrientedCloud: a measured surface without triangles, as points with unit normals, searched by a
// k-d tree. Queries are thread-safe.
//
//   q = the cloud's point closest to x
//   within reach of q:  d(x) = sum_k w_k n_k . (x - q_k) / sum_k w_k
//                       g(x) = sum_k w_k n_k / sum_k w_k
//   beyond:             d(x) = |x - q|,   g(x) = (x - q) / d
//
// The sums run over the eight closest points, w_k = (1 - |x - q_k|^2 / reach^2)^2, or 0 beyond
// reach. They blend the tangent planes of the neighbours, so that d hardly jumps where the
// closest point changes (implicit moving least squares; Kolluri 2008). Beyond reach, points
// beside the measured part count as far.
//
// A normal n_k that points against the normal of q counts with the opposite sign. g neglects how
// the w_k change with x.
// A normal that is not given is that of the plane through the nearest neighbours (least principal
// component; Hoppe et al. 1992). Neighbours on a line define no plane: such a point has a zero
// normal and counts as beyond reach at any distance.
#pragma once

#include <memory>
#include <optional>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/geometry/distance_volume.hpp"

namespace brainshift::geometry {

struct CloudOptions {
  int neighbours = 10;  // for a normal that is not given; at least 3
  // 0: five times the median distance between a point and its nearest neighbour.
  double reach_mm = 0.0;
  // Estimated normals are turned towards this place (a camera); without it their sign is
  // arbitrary.
  std::optional<Vec3> seen_from_mm;
};

class OrientedCloud {
 public:
  // points: 3 x n, n >= 3. normals: 3 x n, scaled to unit length here, or 3 x 0 to estimate them.
  // kEmptySet: fewer than 3 points, or none with a normal. kNotFinite: names the point.
  // kInvalidArgument: the number of normals is neither 0 nor n, a normal has no length, or an
  // option is out of range.
  static Result<OrientedCloud> build(const Points& points, const Points& normals = Points(3, 0),
                                     const CloudOptions& options = {});
  OrientedCloud(OrientedCloud&&) noexcept;
  OrientedCloud& operator=(OrientedCloud&&) noexcept;
  ~OrientedCloud();

  DistanceSample at(const Vec3& x) const;
  // Index of the closest point, and its distance.
  int closest(const Vec3& x, double& distance_mm) const;
  const Points& points() const;
  const Points& normals() const;
  double reach_mm() const;

 private:
  struct Impl;
  explicit OrientedCloud(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::geometry
