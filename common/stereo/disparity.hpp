// SPDX-License-Identifier: GPL-3.0-or-later
// How far every pixel of the left picture is displaced in the right one.
//
//   d(x, y) = x_left - x_right of the same point, px, sub-pixel; rows agree because the pair is rectified.
// Semi-global matching (Hirschmueller 2008, as OpenCV 4.6's StereoSGBM), once from each picture. A pixel is valid when
//   - both matchings agree:   |d_left(x, y) - d_right(x - d_left, y)| <= max_left_right_px,
//   - the picture has texture there: its noise alone would move the match by at most max_texture_sd_px,
//   - it comes from inside both original pictures, and
//   - it hangs together (parts.hpp, max_step_px) with min_part_fraction of the picture: matches by chance are specks.
// Standard deviation of a valid disparity, px:
//   sd^2 = floor_px^2 + 2 s^2 / E + (difference of the two matchings)^2 / 2
//   s = noise_grey; E = sum over the matching block of (dI/dx)^2, less what noise adds to it: the second term is the
//   Cramer-Rao bound of a shift between two noisy copies. The third takes the two matchings for independent readings.
// Confidence = probability that a normal error of this sd is below 1 px: erf(1 / (sqrt(2) sd)).
//
// Assumption: a surface that reflects the same light into both cameras. Highlights and flowing blood do not.
#pragma once

#include "common/core/error.hpp"
#include "common/values/stereo_calibration.hpp"
#include "common/stereo/gray_image.hpp"
#include "common/stereo/rectify.hpp"

namespace brainshift::stereo {

struct MatchOptions {
  int min_disparity_px = 0;
  int disparities = 128;        // number searched, rounded up to a multiple of 16
  int block_px = 5;             // odd; larger ones smooth over vessels
  int uniqueness_percent = 10;  // by which the best match must beat the second best
  double max_left_right_px = 1.0;
  double noise_grey = 2.0;  // sd of a pixel's grey level
  double max_texture_sd_px = 0.5;
  // At any contrast: SGBM's parabola through three costs, and light that differs between the cameras. Photographs of
  // the aloe (tests/sensing/stereo_study.cpp): 0.28 px rms where the other two terms are small.
  double floor_px = 0.25;
  double max_step_px = 1.0;
  double min_part_fraction = 0.005;
  // Below it nothing is given back. Measured on synthetic pairs: 0.78 to 0.93 for a pair of its rig, at most 0.006 for
  // one that is swapped or lies at another depth.
  double min_valid_fraction = 0.10;
};

struct DisparityMap {
  PixelMap<float> disparity_px;  // of the left picture; NaN where not valid
  PixelMap<float> sd_px;         // NaN where not valid
  double valid_fraction = 0.0;   // of the pixels that both cameras may see
};

double confidence(double sd_px);

// Every valid pixel, however few. kInvalidArgument names the option, or pictures of different sizes.
Result<DisparityMap> match(const RectifiedPair& pair, const MatchOptions& options);

// Depths between which a surface is looked for; near and far bound the disparities searched.
struct DepthRange {
  double near_mm = 100.0;  // operating microscopes work at 200 to 500 mm
  double far_mm = 600.0;
};

struct MeasuredDisparity {
  DisparityMap map;
  RectifiedPair pair;
  RectifiedGeometry geometry;
};

// A pair of pictures and the calibration of their cameras -> disparities (min_disparity_px and disparities of the
// options are replaced by the depth range). kInvalidArgument: as rectify, a range that is none, and left and right
// pictures swapped: the pair hardly matches, and matches well the other way round. kEmptySet: too little matches.
Result<MeasuredDisparity> measure_disparity(const GrayImage& left, const GrayImage& right,
                                            const StereoCalibration& calibration,
                                            const DepthRange& range,
                                            const MatchOptions& options = {});

}  // namespace brainshift::stereo
