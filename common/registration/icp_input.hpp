// SPDX-License-Identifier: GPL-3.0-or-later
// The options of align() (icp.hpp), and the checks of its input.
#pragma once

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::registration {

struct IcpOptions {
  int max_iterations = 50;
  double sd_mm = 0.5;            // of a boundary point along the normal
  double welsch_scale_mm = 3.0;  // s: residual at which a point's weight falls to exp(-1/2)
  double rotation_sd_deg = 3.0;  // of the prior; <= 0 switches it off
  bool rotation = true;          // false: translation only
  double translation_tolerance_mm = 1e-4;
  double rotation_tolerance_deg = 1e-4;
  // An axis is reported unobservable when its Hessian eigenvalue (data only, rotation scaled by
  // the point cloud's rms radius) is below this fraction of the largest. At 1e-2 the axis is known
  // ten times worse than the best one. Measured for the least visible rotation: 4.6e-4 for the
  // facets of a sphere of 2,562 vertices, 3e-3 for semi-axes of 14, 13 and 20 mm, 2.6e-2 for 14,
  // 11 and 20 mm.
  double observability_ratio = 1e-2;
};

// Ok, or the error that align() returns.
Status check_alignment(const Points& points, const RigidTransform& T_surface_points_initial,
                       const IcpOptions& options);

}  // namespace brainshift::registration
