// SPDX-License-Identifier: GPL-3.0-or-later
// Traced contours to boundary points in space.
//
// A contour is a polyline of pixels (u, v) of one image; x = T_target_image (u, v, 0). It is
// resampled at equal arc length in mm, so that every mm of boundary weighs the same however
// densely a person clicked. The default spacing of 0.2 mm is that of the paper's section 2.5.
#pragma once

#include <limits>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::ultrasound {

struct Contour {
  int frame = 0;  // of the recording, from 0
  // Of the image, s since 1970 UTC, where that names it; then `frame` says nothing. NaN: none.
  double time_s = std::numeric_limits<double>::quiet_NaN();
  bool closed = true;          // the last point is joined to the first
  Eigen::Matrix2Xd points_px;  // columns (u, v)
};

constexpr double kBoundarySpacing_mm = 0.2;

// 3 x m in the target frame, mm. The spacing is stretched so that a whole number of steps fits. An
// open contour keeps both ends.
// kInvalidArgument: a spacing <= 0; with the frame: fewer than 3 points (open: 2), a contour
// without length, more than 1e6 points to make. kNotFinite: a point, with the frame.
Result<Points> boundary_points(const Contour& contour, const AffineTransform& T_target_image,
                               double spacing_mm = kBoundarySpacing_mm);

}  // namespace brainshift::ultrasound
