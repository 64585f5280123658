// SPDX-License-Identifier: GPL-3.0-or-later
// How far every pixel of the left picture is displaced in the right one.
//
//   d(x, y) = x_left - x_right of the same point, px, sub-pixel
// Rows agree because the pair is rectified. The matching is semi-global (Hirschmueller 2008, as
// OpenCV 4.6's StereoSGBM), once from each picture. A pixel is valid when
//   - both matchings agree:   |d_left(x, y) - d_right(x - d_left, y)| <= max_left_right_px,
//   - the picture has texture there: its noise alone moves the match by at most kMaxTextureSd_px,
//   - it comes from inside both original pictures, and
//   - it is connected (cleaning.hpp, steps of 1 px) to min_part_fraction of the picture: matches by
//     chance are specks.
// Standard deviation of a valid disparity, px:
//   sd^2 = kFloor_px^2 + 2 s^2 / E + (difference of the two matchings)^2 / 2
//   s = kNoiseGrey; E = sum over the matching block of (dI/dx)^2, less what noise adds to it
// The second term is the Cramer-Rao bound of a shift between two noisy copies. The third treats
// the two matchings as independent readings.
// Confidence = probability that a normal error of this sd is below 1 px: erf(1 / (sqrt(2) sd)).
//
// Assumption: the surface reflects the same light into both cameras. Highlights and flowing blood
// do not.
#pragma once

#include "common/configuration/stereo_calibration.hpp"
#include "common/core/error.hpp"
#include "common/stereo/gray_image.hpp"

namespace brainshift::stereo {

// Both pictures of a pair resampled as two parallel cameras would have taken them, so that a point
// lies in the same row of both (Fusiello, Trucco & Verri 2000; OpenCV 4.6, stereoRectify).
//
// With f, c_l, c_r (columns), c_y (row) of the geometry and the disparity d = x_left - x_right at
// the left pixel (x, y):
//   Z = f b / (d - c_l + c_r),   X = (x - c_l) Z / f,   Y = (y - c_y) Z / f
//   (X, Y, Z): mm, rectified left frame;  R_left_rectified (X, Y, Z): left camera frame
// c_l and c_r differ, so that cameras turned towards each other keep what both see. d may be
// negative.
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

inline constexpr double kMaxTextureSd_px = 0.5;
// Standard deviation of a pixel's grey level.
inline constexpr double kNoiseGrey = 2.0;
// Error at any contrast, from SGBM's parabola through three costs and from light that differs
// between the cameras. On photographs of the aloe (tests/sensing/stereo_study.cpp) it is 0.28 px
// rms where the other two terms are small.
inline constexpr double kFloor_px = 0.25;

struct MatchOptions {
  int min_disparity_px = 0;
  int disparities = 128;        // number searched, rounded up to a multiple of 16
  int uniqueness_percent = 10;  // by which the best match must beat the second best
  double max_left_right_px = 1.0;
  double min_part_fraction = 0.005;
};

struct DisparityMap {
  PixelMap<float> disparity_px;  // of the left picture; NaN where not valid
  PixelMap<float> sd_px;         // NaN where not valid
  double valid_fraction = 0.0;   // of the left pixels from inside the original picture
};

// 0 to 1.
double confidence(double sd_px);

// Every valid pixel, however few. kInvalidArgument: an option out of range (named), pictures that
// are empty or differ in size.
Result<DisparityMap> match(const RectifiedPair& pair, const MatchOptions& options);

// Depths between which a surface is searched. They bound the disparities.
struct DepthRange {
  double near_mm = 100.0;  // operating microscopes work at 200 to 500 mm
  double far_mm = 600.0;
};

struct MeasuredDisparity {
  DisparityMap map;
  RectifiedPair pair;
  RectifiedGeometry geometry;
};

// A pair of pictures and the calibration of their cameras -> disparities. The depth range replaces
// min_disparity_px and disparities of the options.
// kInvalidArgument: as rectify and match; a depth range that is not 0 < near < far, or so near
// that no point lies in both pictures; left and right pictures swapped (the pair hardly matches,
// and matches well the other way round). kEmptySet: a valid fraction below a tenth.
Result<MeasuredDisparity> measure_disparity(const GrayImage& left, const GrayImage& right,
                                            const StereoCalibration& calibration,
                                            const DepthRange& range,
                                            const MatchOptions& options = {});

}  // namespace brainshift::stereo
