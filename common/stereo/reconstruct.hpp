// SPDX-License-Identifier: GPL-3.0-or-later
// A disparity map -> triangles in patient RAS, with the standard deviation of every vertex.
//
// 1. Parts of the map: neighbouring pixels whose disparities differ by at most max_step_px hang together; parts smaller
//    than min_part_fraction of the largest are dropped (instruments, specks).
// 2. Blocks of step x step pixels become one vertex: the mean position and mean disparity of the block's pixels within
//    max_step_px of their median, where at least half of the block is valid. step follows from spacing_mm and
//    max_points.
// 3. Vertices whose mean distance to their 8 nearest neighbours exceeds the mean of that figure by outlier_sds standard
//    deviations are dropped (Rusu et al. 2008).
// 4. Blocks that are neighbours in the picture become triangles, counter-clockwise seen from the camera, so that their
//    normals look towards it: outwards, for a surgeon's camera. Triangles seen at more than max_view_angle_deg, which
//    span a jump in depth, are left out, and vertices without a triangle.
// 5. T_ras_camera (left camera frame) is applied.
//
// Standard deviation of a vertex along the line of sight, mm: Z^2 / (f b) sd_d, with sd_d^2 the mean over the block's
// pixels. It is not divided by their number: semi-global matching makes neighbours share their error.
#pragma once

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"
#include "common/stereo/disparity.hpp"

namespace brainshift::stereo {

struct ReconstructOptions {
  double spacing_mm =
      1.0;  // between vertices, at the median depth; the model's elements are 5 times as long
  int max_points = 20000;  // the spacing grows until no more blocks are left
  double max_step_px = 2.0;
  double min_part_fraction = 0.05;
  double outlier_sds = 3.0;
  double max_view_angle_deg = 75.0;
  int min_points = 50;  // below it nothing is given back
};

struct ReconstructedSurface {
  TriangleSurface surface;  // mm RAS
  VecX sd_mm;               // per vertex, along the line of sight
  VecX confidence;          // per vertex, 0 to 1: disparity.hpp
  int valid_pixels = 0, pixels_in_small_parts = 0, outlier_points = 0;
  double median_depth_mm = 0.0;
  double median_sd_mm = 0.0;
};

// kInvalidArgument: an option out of range, a pose that is no rigid motion. kEmptySet: fewer than min_points vertices.
Result<ReconstructedSurface> reconstruct(const DisparityMap& map, const RectifiedGeometry& geometry,
                                         const RigidTransform& T_ras_camera,
                                         const ReconstructOptions& options = {});

}  // namespace brainshift::stereo
