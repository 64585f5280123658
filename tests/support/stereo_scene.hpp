// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures of known scenes by two known cameras, computed ray by ray: a bumpy, textured patch
// like an exposed cortex, and a chessboard. Independent of the code under test: own lens, own
// rays.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/configuration/stereo_calibration.hpp"
#include "common/core/types.hpp"
#include "common/stereo/calibrate.hpp"
#include "common/stereo/gray_image.hpp"

namespace brainshift::test_support {

enum class Eye { kLeft, kRight };

// Two cameras of 640 x 480 px, 1100 px focal length, 30 mm apart, turned so that their axes meet
// at `meet_mm`. Their lenses distort by a few pixels at the rim.
StereoCalibration operating_rig(double meet_mm = 250.0);

// Pixel of a point in the left camera's frame; Brown's lens.
Eigen::Vector2d project(const StereoCalibration& rig, Eye eye, const Vec3& x_left);

// Line of sight of a pixel, in the left camera's frame: from the camera's centre along a
// direction.
struct Ray {
  Vec3 origin, direction;
};
Ray ray_through(const StereoCalibration& rig, Eye eye, const Eigen::Vector2d& pixel);

// z(x, y) in the left camera's frame, mm: a tilted cap (radius of curvature 80 mm) with gyri.
struct Patch {
  double depth_mm = 250.0;
  double gyri_mm = 1.0;       // amplitude
  double contrast = 60.0;     // sd of the grey levels; 0: a white wall
  double noise_grey = 1.0;    // sd of a pixel's noise
  double radius_mm = 1000.0;  // beyond it there is nothing: black
};
double patch_depth(const Patch& patch, double x, double y);
// Unit normal towards the cameras.
Vec3 patch_normal(const Patch& patch, double x, double y);

stereo::GrayImage render(const StereoCalibration& rig, Eye eye, const Patch& patch,
                         std::uint64_t seed);

// The board's inner corner (i, j) lies at (i, j, 0) square_mm of the board's frame.
stereo::GrayImage render(const StereoCalibration& rig, Eye eye, const stereo::ChessBoard& board,
                         const RigidTransform& T_left_board);
stereo::BoardCorners exact_corners(const StereoCalibration& rig, const stereo::ChessBoard& board,
                                   const RigidTransform& T_left_board);
// Poses in view of both cameras, tilted by up to 30 degrees; the same for the same index.
RigidTransform board_pose(int index, const stereo::ChessBoard& board, double depth_mm = 250.0);

}  // namespace brainshift::test_support
