// SPDX-License-Identifier: GPL-3.0-or-later
// A disparity map -> triangles in patient RAS, with the standard deviation of every vertex.
//
// 1. Parts of the map (parts.hpp, kMaxPartStep_px) smaller than kMinPart of the largest are
//    dropped: instruments, specks.
// 2. A block of step x step pixels becomes one vertex where at least half of it is valid: the mean
//    position and mean disparity of its pixels within kMaxPartStep_px of their median. spacing_mm
//    and max_points decide step.
// 3. Vertices far from their 8 nearest neighbours are dropped (cleaning.hpp, kOutlierSds).
// 4. Blocks that are neighbours in the picture become triangles, counter-clockwise seen from the
//    camera. Their normals point towards it: outwards, for a surgeon's camera. Triangles seen at
//    more than kMaxViewAngle_deg span a jump in depth and are left out, as are vertices without a
//    triangle.
// 5. T_ras_camera (left camera frame) is applied.
//
// Standard deviation of a vertex along the line of sight, mm: Z^2 / (f b) sd_d, with sd_d^2 the
// mean over the block's pixels. It is not divided by their number, because semi-global matching
// makes neighbours share their error.
#pragma once

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"
#include "common/stereo/disparity.hpp"

namespace brainshift::stereo {

inline constexpr double kMaxPartStep_px = 2.0;
inline constexpr double kMinPart = 0.05;
inline constexpr double kOutlierSds = 3.0;
inline constexpr double kMaxViewAngle_deg = 75.0;
inline constexpr int kFewestPoints = 50;

struct ReconstructOptions {
  // Between vertices, at the median depth. The model's elements are 5 times as long.
  double spacing_mm = 1.0;
  int max_points = 20000;  // the spacing grows until there are no more blocks than this
};

struct ReconstructedSurface {
  TriangleSurface surface;        // mm RAS
  VecX sd_mm;                     // per vertex, along the line of sight
  VecX confidence;                // per vertex, 0 to 1: disparity.hpp
  int pixels_in_small_parts = 0;  // of the map, dropped in step 1
  int outlier_points = 0;         // vertices dropped in step 3
  double median_depth_mm = 0.0;
  double median_sd_mm = 0.0;
};

// T_ras_camera: left camera frame to patient RAS, mm. kInvalidArgument: an option out of range
// (named), a pose that is not a rigid motion. kEmptySet: fewer than kFewestPoints vertices.
Result<ReconstructedSurface> reconstruct(const DisparityMap& map, const RectifiedGeometry& geometry,
                                         const RigidTransform& T_ras_camera,
                                         const ReconstructOptions& options = {});

}  // namespace brainshift::stereo
