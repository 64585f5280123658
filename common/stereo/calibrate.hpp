// SPDX-License-Identifier: GPL-3.0-or-later
// A stereo calibration from pictures of a chessboard taken by both cameras at once.
//
// The board's inner corners lie at (i, j, 0) x square_mm. Intrinsics, distortion, T_right_left and the pose of every
// board minimise the sum of squared distances between seen and projected corners over both pictures:
//   rms_px = sqrt(sum |seen - projected|^2 / number of corners)
// First each camera alone (Zhang 2000), then all together (OpenCV 4.6, calib3d). Three radial terms need corners at the
// picture's rim; k3 is kept at 0, because boards seldom reach it.
// Independent of that minimisation, the epipolar error: the distance of a corner, undistorted, from the line on which
// its partner in the other picture says that it must lie (Hartley & Zisserman 2004, section 11.4.3), rms over both
// pictures.
//
// Assumption: corners are found with independent errors of equal size; the board is flat and moved between pairs.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/values/stereo_calibration.hpp"
#include "common/stereo/gray_image.hpp"

namespace brainshift::stereo {

struct ChessBoard {
  int columns = 9, rows = 6;  // inner corners, columns != rows so that a turned board is known
  double square_mm = 25.0;
};

// Ok, or kInvalidArgument naming the key: fewer than 3 x 3 corners, or a square that has no size.
Status validate(const ChessBoard& board);

struct CalibrationOptions {
  int min_pairs = 5;  // below it the boards' tilts hardly separate focal length from distance
  // A calibration worse than this has mixed up its boards or its cameras; good ones stay below 0.5.
  double max_rms_px = 2.0;
};

// Corners of one board in both pictures, 2 x n px, row by row of the board.
struct BoardCorners {
  std::string name;
  Eigen::Matrix2Xd left, right;
};

struct PicturePair {
  std::string name;
  GrayImage left, right;
};

// Distance of a corner, undistorted, from the epipolar line of its partner, rms over both pictures, px; also for
// corners that took no part in the calibration. Precondition: as many corners left as right, at least one.
double epipolar_rms(const StereoCalibration& calibration, const std::vector<BoardCorners>& corners);

// Inner corners of the board in a picture, refined to sub-pixel; empty when it is not seen whole.
Eigen::Matrix2Xd find_corners(const GrayImage& picture, const ChessBoard& board);

// From corners at hand. kInvalidArgument: too few pairs, a number of corners that is not the board's, pictures of no
// size, left and right swapped. kNotConverged: rms above options.max_rms_px, or a minimisation that fails.
Result<StereoCalibration> calibrate(const std::vector<BoardCorners>& corners,
                                    const ChessBoard& board, int width_px, int height_px,
                                    const CalibrationOptions& options = {});

struct CalibrationResult {
  StereoCalibration calibration;
  std::vector<std::string> without_board;  // names of pairs in which a picture shows no whole board
};

// From pictures. As above; kInvalidArgument also for pictures of different sizes (the sentence names the pair).
Result<CalibrationResult> calibrate(const std::vector<PicturePair>& pairs, const ChessBoard& board,
                                    const CalibrationOptions& options = {});

}  // namespace brainshift::stereo
