// SPDX-License-Identifier: GPL-3.0-or-later
// Calibration file of two cameras: YAML, every key with its unit (values/stereo_calibration.hpp
// says what they mean).
//
//   image: {width_px: 640, height_px: 480}
//   left:                       # and right
//     focal_x_px: 1100.0
//     focal_y_px: 1102.0
//     centre_x_px: 322.0
//     centre_y_px: 238.0
//     distortion: [k1, k2, p1, p2, k3]
//   T_right_left:               # x_right = rotation x_left + translation
//     rotation: [nine numbers, row by row]
//     translation_mm: [-30.0, 0.0, 0.0]
//   rms_px: 0.31                # optional, as is what follows: how well the calibration fits
//   epipolar_rms_px: 0.25
//   pairs: {"left01.jpg": 0.30, "left02.jpg": 0.33}      # reprojection error, px
#pragma once

#include <filesystem>
#include <string>

#include "common/configuration/stereo_calibration.hpp"
#include "common/core/error.hpp"

namespace brainshift::io {

// kNotFound, kUnreadable, or kInvalidArgument: one line with file, line, key and constraint; the
// calibration is valid.
Result<StereoCalibration> read_calibration(const std::filesystem::path& path);

// Numbers with all their digits: what is read back is equal up to the rounding of an orthonormal
// rotation. kWriteFailed.
Status write_calibration(const std::filesystem::path& path, const StereoCalibration& calibration);
std::string calibration_text(const StereoCalibration& calibration);

}  // namespace brainshift::io
