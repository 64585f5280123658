// SPDX-License-Identifier: GPL-3.0-or-later
// Both pictures of a pair resampled as two parallel cameras would have taken them, so that a point
// lies in the same row of both (Fusiello, Trucco & Verri 2000; OpenCV 4.6, stereoRectify).
//
// With f, c_l, c_r (columns), c_y (row) of the geometry and the disparity d = x_left - x_right at
// the left pixel (x, y):
//   Z = f b / (d - c_l + c_r),   X = (x - c_l) Z / f,   Y = (y - c_y) Z / f
//   (X, Y, Z): mm, rectified left frame;  R_left_rectified (X, Y, Z): left camera frame
// c_l and c_r differ, so that cameras turned towards each other keep what both see. d may be
// negative.
#pragma once

#include "common/configuration/stereo_calibration.hpp"
#include "common/core/error.hpp"
#include "common/stereo/gray_image.hpp"

namespace brainshift::stereo {

struct RectifiedGeometry {
  double focal_px = 0.0;
  double centre_left_px = 0.0, centre_right_px = 0.0;  // columns
  double centre_row_px = 0.0;
  double baseline_mm = 0.0;
  Mat3 R_left_rectified = Mat3::Identity();  // turns the rectified frame into the left camera's
};

// Disparity of a point at a depth Z, and back. Preconditions: Z > 0; d greater than the disparity
// of a point at infinity, centre_left - centre_right (a smaller d gives a depth <= 0).
double disparity_at(const RectifiedGeometry& geometry, double depth_mm);
double depth_at(const RectifiedGeometry& geometry, double disparity_px);
// The point of a left pixel with its disparity, left camera frame, mm.
Vec3 triangulate(const RectifiedGeometry& geometry, double x_px, double y_px, double disparity_px);
// Standard deviation of the depth, Z^2 / (f b) sd_d, mm, of a point of this disparity.
double depth_sd_mm(const RectifiedGeometry& geometry, double disparity_px, double disparity_sd_px);

struct RectifiedPair {
  GrayImage left, right;
  // 1 where the pixel comes from inside the original picture, else 0; empty: everywhere.
  GrayImage left_seen, right_seen;
};

struct Rectified {
  RectifiedPair pair;
  RectifiedGeometry geometry;
};

// kInvalidArgument: a picture without the calibration's size, an invalid calibration, or cameras
// that do not stand side by side.
Result<Rectified> rectify(const GrayImage& left, const GrayImage& right,
                          const StereoCalibration& calibration);

}  // namespace brainshift::stereo
