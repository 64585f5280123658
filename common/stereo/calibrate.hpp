// SPDX-License-Identifier: GPL-3.0-or-later
// A stereo calibration from pictures of a chessboard taken by both cameras at once.
//
// The board's inner corners lie at (i, j, 0) x square_mm. Intrinsics, distortion, T_right_left and
// the pose of every board minimise the sum of squared distances between seen and projected corners
// over both pictures:
//   rms_px = sqrt(sum |seen - projected|^2 / number of corners)
// First each camera is calibrated alone (Zhang 2000), then all together (OpenCV 4.6, calib3d). A
// third radial term needs corners at the picture's rim. Boards seldom reach it, so k3 stays 0.
//
// The epipolar error is independent of that minimisation: the distance of a corner, undistorted,
// from the epipolar line of its partner in the other picture (Hartley & Zisserman 2004, section
// 11.4.3), rms over both pictures.
//
// Assumption: corners are found with independent errors of equal size. The board is flat and moved
// between pairs.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/configuration/stereo_calibration.hpp"
#include "common/core/error.hpp"
#include "common/stereo/gray_image.hpp"

namespace brainshift::stereo {

struct ChessBoard {
  // Inner corners. With columns != rows a board turned by a quarter is recognised.
  int columns = 9, rows = 6;
  double square_mm = 25.0;
};

// kInvalidArgument with the key: fewer than 3 or more than 100 corners along a side, a square_mm
// that is not finite and > 0.
Status validate(const ChessBoard& board);

// With fewer, the boards' tilts hardly separate focal length from distance.
inline constexpr int kFewestPairs = 5;
// A calibration worse than this mixed up its boards or its cameras. Good ones stay below 0.5.
inline constexpr double kMaxRms_px = 2.0;

// Corners of one board in both pictures, 2 x n px, row by row of the board.
struct BoardCorners {
  std::string name;
  Eigen::Matrix2Xd left, right;
};

struct PicturePair {
  std::string name;
  GrayImage left, right;
};

// The epipolar error, px; also of corners that took no part in the calibration. Precondition: as
// many corners left as right, at least one.
double epipolar_rms(const StereoCalibration& calibration, const std::vector<BoardCorners>& corners);

// Inner corners of the board in a picture, 2 x n px, refined to sub-pixel. Empty when the picture
// does not show the whole board.
Eigen::Matrix2Xd find_corners(const GrayImage& picture, const ChessBoard& board);

// From corners at hand. kInvalidArgument: a bad board (validate), too few pairs, a number of
// corners that is not the board's, pictures of no size, left and right swapped. kNotConverged: rms
// above kMaxRms_px, or a minimisation that fails.
Result<StereoCalibration> calibrate(const std::vector<BoardCorners>& corners,
                                    const ChessBoard& board, int width_px, int height_px);

struct CalibrationResult {
  StereoCalibration calibration;
  std::vector<std::string> without_board;  // names of pairs with a picture without a whole board
};

// From pictures. Errors as above; kInvalidArgument also for pictures of different sizes, with the
// pair's name.
Result<CalibrationResult> calibrate(const std::vector<PicturePair>& pairs, const ChessBoard& board);

}  // namespace brainshift::stereo
