// SPDX-License-Identifier: Apache-2.0
// StereoCalibration: the optics of two cameras and the pose of one relative to the other.
//
// Camera frame: origin at the optical centre, x to the right of the picture, y down, z along the
// line of sight, mm. A point (x, y, z) appears at the pixel
//   u = focal_x x' + centre_x,   v = focal_y y' + centre_y
// where (x', y') is (x / z, y / z) displaced by the lens (Brown 1966; coefficients k1, k2, p1,
// p2, k3). With x and y for x / z and y / z, and r^2 = x^2 + y^2:
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

// How well one pair of pictures of the chessboard fits the calibration.
struct CalibrationPair {
  std::string name;     // of the left picture
  double rms_px = 0.0;  // reprojection error of its corners in both pictures
};

struct StereoCalibration {
  int width_px = 0, height_px = 0;  // of both pictures
  CameraIntrinsics left, right;
  RigidTransform T_right_left = RigidTransform::Identity();
  double rms_px = 0.0;  // reprojection error over all corners
  // Distance of a corner from the epipolar line of its partner, lens distortion removed.
  double epipolar_rms_px = 0.0;
  std::vector<CalibrationPair> pairs;
};

// Position of the right camera in the left camera's frame, mm. x > 0: the cameras are in order.
Vec3 right_camera_in_left(const StereoCalibration& calibration);

// Ok, or kInvalidArgument that names key, value and constraint. Rejects a right camera that
// stands to the left of the left one (swapped), and cameras one above the other.
Status validate(const StereoCalibration& calibration);

// Ok, or kInvalidArgument when the matrix is not a rigid motion within 1e-4
// (core/rigid_motion.hpp): a calibration has more digits than a pose that somebody wrote down.
// The message begins with `name`. kNotFinite.
Status check_rigid(const std::string& name, const Eigen::Matrix4d& matrix);

}  // namespace brainshift
