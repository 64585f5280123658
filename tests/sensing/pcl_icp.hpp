// SPDX-License-Identifier: GPL-3.0-or-later
// The registration that ours is compared with: ICP of the Point Cloud Library, on vertices. This
// header hides PCL's own.
#pragma once

#include <memory>

#include "common/core/mesh.hpp"
#include "common/core/types.hpp"

namespace brainshift::sensing {

class PclIcp {
 public:
  // plane: IterativeClosestPointWithNormals (point to plane), else IterativeClosestPoint (point to
  // point). The search tree over the vertices is built here, not while aligning. PCL stops when
  // the pose changes by less than 1e-4 mm, or after max_iterations (its own default: 10).
  PclIcp(const TriangleSurface& surface, const Points& normals, bool plane, int max_iterations);
  ~PclIcp();
  // T_surface_points, from the identity. `align_ms` receives the time of align() alone.
  RigidTransform align(const Points& points, double& align_ms);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::sensing
