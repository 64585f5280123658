// SPDX-License-Identifier: GPL-3.0-or-later
// A measured surface without triangles: points with unit normals, searched by a k-d tree. Queries are thread-safe.
//
//   q = the cloud's point closest to x
//   within reach of q:  d(x) = sum_k w_k n_k . (x - q_k) / sum_k w_k,   g = sum_k w_k n_k / sum_k w_k
//                       over the eight closest points, w_k = (1 - |x - q_k|^2 / reach^2)^2 or 0 beyond reach: the
//                       planes of the neighbours blended, so that d hardly jumps where the closest point changes
//                       (implicit moving least squares; Kolluri 2008)
//   beyond:             d(x) = |x - q|,     g = (x - q)/d   (so that points beside what was measured count as far)
//
// Normals that point the other way than that of q count with the opposite sign. g neglects how the w_k change.
// Normals that are not given are those of the plane through the nearest neighbours (least principal component;
// Hoppe et al. 1992). Where the neighbours lie on a line there is no plane: such a point has a zero normal, and
// counts as beyond reach at any distance.
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
  // Normals are turned towards this place (a camera), else their sign is arbitrary.
  std::optional<Vec3> seen_from_mm;
};

class OrientedCloud {
 public:
  // points: 3 x n, n >= 3. normals: 3 x n, or 3 x 0 to have them estimated; scaled to unit length.
  // kEmptySet: fewer than 3 points, or none with a normal. kNotFinite: names the point. kInvalidArgument: as many
  // normals as points are wanted, a normal of no length, an option out of range.
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
