// SPDX-License-Identifier: Apache-2.0
// StereoCalibration: how two cameras see and how they stand to each other.
//
// Camera frame: origin at the optical centre, x to the right of the picture, y down, z along the line of sight, mm.
// A point (x, y, z) is seen at the pixel u = focal_x x' + centre_x, v = focal_y y' + centre_y, where (x', y') is
// (x / z, y / z) displaced by the lens (Brown 1966; coefficients k1, k2, p1, p2, k3, r^2 = x^2 + y^2 of x / z, y / z):
//   x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2)
//   y' = y (1 + k1 r^2 + k2 r^4 + k3 r^6) + p1 (r^2 + 2 y^2) + 2 p2 x y
// Pixel centres have integer coordinates, (0, 0) is the first one of the first row.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift {

struct CameraIntrinsics {
  double focal_x_px = 0.0, focal_y_px = 0.0;
  double centre_x_px = 0.0, centre_y_px = 0.0;
  std::array<double, 5> distortion{};  // k1, k2, p1, p2, k3
};

// What one pair of pictures of the chessboard says about the calibration.
struct CalibrationPair {
  std::string name;     // of the left picture
  double rms_px = 0.0;  // reprojection error of its corners in both pictures
};

struct StereoCalibration {
  int width_px = 0, height_px = 0;  // of both pictures
  CameraIntrinsics left, right;
  RigidTransform T_right_left = RigidTransform::Identity();
  double rms_px = 0.0;  // reprojection error over all corners
  double epipolar_rms_px =
      0.0;  // distance of a corner from the epipolar line of its partner, undistorted
  std::vector<CalibrationPair> pairs;
};

// Position of the right camera in the left camera's frame, mm; to the right (x > 0) for cameras in order.
Vec3 right_camera_in_left(const StereoCalibration& calibration);

// Ok, or kInvalidArgument naming key, value and constraint. Left and right swapped (the right camera stands on the
// left) and cameras one above the other are refused.
Status validate(const StereoCalibration& calibration);

// Ok, or kInvalidArgument: `name` is no rigid motion (deviation of R^T R from 1, or a mirror image) within 1e-4, what
// four decimals in a file leave; kNotFinite.
Status check_rigid(const std::string& name, const Eigen::Matrix4d& matrix);

// The rigid motion nearest to a matrix that passes check_rigid: its rotation made orthonormal.
RigidTransform nearest_rigid(const Eigen::Matrix4d& matrix);

}  // namespace brainshift
