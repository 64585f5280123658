// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/stereo/disparity.hpp"

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/stereo/cleaning.hpp"
#include "common/stereo/cv_image.hpp"

namespace brainshift::stereo {
namespace {

Status check_size(const char* side, const GrayImage& picture,
                  const StereoCalibration& calibration) {
  if (picture.width == calibration.width_px && picture.height == calibration.height_px) return {};
  return invalid(fmt::format("the {} picture has {} x {} px: the calibration is for {} x {} px",
                             side, picture.width, picture.height, calibration.width_px,
                             calibration.height_px));
}

// One picture as its rectified camera sees it, and where that lies inside the original.
void resample(const GrayImage& picture, const CameraIntrinsics& camera, const cv::Matx33d& R,
              const cv::Mat& P, GrayImage& out, GrayImage& seen) {
  cv::Mat map_x, map_y, moved;
  cv::initUndistortRectifyMap(camera_matrix(camera), distortion_of(camera), R, P,
                              {picture.width, picture.height}, CV_32FC1, map_x, map_y);
  cv::remap(view_of(picture), moved, map_x, map_y, cv::INTER_CUBIC, cv::BORDER_CONSTANT);
  out = gray_from(moved);
  seen = GrayImage(picture.width, picture.height);
  for (int y = 0; y < seen.height; ++y) {
    for (int x = 0; x < seen.width; ++x) {
      const float u = map_x.at<float>(y, x), v = map_y.at<float>(y, x);
      seen.at(x, y) = u >= 0.0F && v >= 0.0F && u <= static_cast<float>(picture.width - 1) &&
                      v <= static_cast<float>(picture.height - 1);
    }
  }
}

}  // namespace

double disparity_at(const RectifiedGeometry& g, double depth_mm) {
  assert(depth_mm > 0.0);
  return g.focal_px * g.baseline_mm / depth_mm + g.centre_left_px - g.centre_right_px;
}

double depth_at(const RectifiedGeometry& g, double disparity_px) {
  return g.focal_px * g.baseline_mm / (disparity_px - g.centre_left_px + g.centre_right_px);
}

Vec3 triangulate(const RectifiedGeometry& g, double x_px, double y_px, double disparity_px) {
  const double z = depth_at(g, disparity_px);
  return g.R_left_rectified * Vec3((x_px - g.centre_left_px) * z / g.focal_px,
                                   (y_px - g.centre_row_px) * z / g.focal_px, z);
}

double depth_sd_mm(const RectifiedGeometry& g, double disparity_px, double disparity_sd_px) {
  const double z = depth_at(g, disparity_px);
  return z * z / (g.focal_px * g.baseline_mm) * disparity_sd_px;
}

Result<Rectified> rectify(const GrayImage& left, const GrayImage& right,
                          const StereoCalibration& calibration) {
  if (Status ok = validate(calibration); !ok) return tl::unexpected(ok.error());
  if (Status ok = check_size("left", left, calibration); !ok) return tl::unexpected(ok.error());
  if (Status ok = check_size("right", right, calibration); !ok) return tl::unexpected(ok.error());
  cv::Matx33d R1, R2;
  cv::Mat P1, P2, Q;
  cv::stereoRectify(camera_matrix(calibration.left), distortion_of(calibration.left),
                    camera_matrix(calibration.right), distortion_of(calibration.right),
                    {left.width, left.height}, rotation_of(calibration.T_right_left),
                    translation_of(calibration.T_right_left), R1, R2, P1, P2, Q, 0);
  Rectified rectified;
  RectifiedGeometry& g = rectified.geometry;
  g.focal_px = P1.at<double>(0, 0);
  g.centre_left_px = P1.at<double>(0, 2);
  g.centre_right_px = P2.at<double>(0, 2);
  g.centre_row_px = P1.at<double>(1, 2);
  g.baseline_mm = -P2.at<double>(0, 3) / P2.at<double>(0, 0);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) g.R_left_rectified(i, j) = R1(j, i);
  // OpenCV takes the larger component of the baseline. A valid calibration may still be too near
  // the diagonal.
  if (!(g.baseline_mm > 0.0) || P2.at<double>(1, 3) != 0.0) {
    return invalid("T_right_left: the cameras do not stand side by side enough to be rectified");
  }
  resample(left, calibration.left, R1, P1, rectified.pair.left, rectified.pair.left_seen);
  resample(right, calibration.right, R2, P2, rectified.pair.right, rectified.pair.right_seen);
  return rectified;
}

namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr int kDisparityScale = 16;  // StereoSGBM counts sixteenths of a pixel
// Penalties of a disparity that changes by one pixel, and by more, per pixel of the block
// (Hirschmueller's P1 and P2 as OpenCV's manual scales them).
constexpr int kSmallStep = 8, kLargeStep = 32;
constexpr int kPreFilterCap = 31;
constexpr int kBlock_px = 5;  // odd; larger blocks smooth over vessels
// Between neighbours of one part of the picture.
constexpr double kMaxStep_px = 1.0;
// With a smaller valid fraction, left and right are no pair. Measured on synthetic pairs: 0.78 to
// 0.93 for a pair of its rig, at most 0.006 for one that is swapped or lies at another depth.
constexpr double kMinValid = 0.10;
// SGBM's own check is off: it guesses the right picture's disparities from the left one's costs,
// and takes -1 for 1 px. Here both pictures are matched.
constexpr int kNoOwnCheck = 10000;
// Sobel's 3 x 3 derivative, over 8: white noise of variance 1 gives one of this variance.
constexpr double kSobelNoise = 12.0 / 64.0;
constexpr int kMaxDisparities = 2048;
// Turned round, a swapped pair matches much better than as it was given.
constexpr double kSwappedGain = 2.0;

Status check_match(const RectifiedPair& pair, const MatchOptions& options) {
  const auto refuse = [](const char* name, double value, const char* must) {
    return invalid(fmt::format("{} = {}: must be {}", name, value, must));
  };
  if (options.disparities < 1 || options.disparities > kMaxDisparities)
    return refuse("disparities", options.disparities, "between 1 and 2048");
  if (!(options.max_left_right_px > 0.0))
    return refuse("max_left_right_px", options.max_left_right_px, "> 0");
  if (pair.left.empty() || pair.left.width != pair.right.width ||
      pair.left.height != pair.right.height) {
    return invalid(
        fmt::format("the left picture has {} x {} px, the right one {} x {} px: must be "
                    "equal and not empty",
                    pair.left.width, pair.left.height, pair.right.width, pair.right.height));
  }
  return {};
}

// Disparities of the first picture in px, NaN where there is none. Both pictures are widened,
// because SGBM leaves a strip without result where the search would leave the second picture.
cv::Mat match_one_way(const cv::Mat& first, const cv::Mat& second, const MatchOptions& options) {
  const int searched = (options.disparities + 15) / 16 * 16;
  const int widen_left = std::max(0, options.min_disparity_px + searched);
  const int widen_right = std::max(0, -options.min_disparity_px);
  cv::Mat wide_first, wide_second, sixteenths;
  for (auto [from, to] : {std::pair(&first, &wide_first), std::pair(&second, &wide_second)})
    cv::copyMakeBorder(*from, *to, 0, 0, widen_left, widen_right, cv::BORDER_REPLICATE);
  const int area = kBlock_px * kBlock_px;
  const auto sgbm = cv::StereoSGBM::create(
      options.min_disparity_px, searched, kBlock_px, kSmallStep * area, kLargeStep * area,
      kNoOwnCheck, kPreFilterCap, options.uniqueness_percent, 0, 0, cv::StereoSGBM::MODE_SGBM);
  sgbm->compute(wide_first, wide_second, sixteenths);
  cv::Mat disparity(first.size(), CV_32FC1);
  for (int y = 0; y < first.rows; ++y) {
    for (int x = 0; x < first.cols; ++x) {
      const short value = sixteenths.at<short>(y, x + widen_left);
      disparity.at<float>(y, x) = value < options.min_disparity_px * kDisparityScale
                                      ? kNone
                                      : static_cast<float>(value) / kDisparityScale;
    }
  }
  return disparity;
}

// The right picture's disparities: the pair in a mirror, where right becomes left.
cv::Mat match_from_right(const cv::Mat& left, const cv::Mat& right, const MatchOptions& options) {
  cv::Mat mirrored_left, mirrored_right, disparity;
  cv::flip(left, mirrored_left, 1);
  cv::flip(right, mirrored_right, 1);
  cv::flip(match_one_way(mirrored_right, mirrored_left, options), disparity, 1);
  return disparity;
}

// Cramer-Rao bound of the shift at every pixel, px; infinite without texture.
cv::Mat texture_sd(const cv::Mat& left) {
  cv::Mat slope, energy;
  cv::Sobel(left, slope, CV_64F, 1, 0, 3, 1.0 / 8.0);
  cv::boxFilter(slope.mul(slope), energy, CV_64F, {kBlock_px, kBlock_px}, {-1, -1}, false,
                cv::BORDER_REPLICATE);
  const double noise = kNoiseGrey * kNoiseGrey;
  const double noise_energy = kBlock_px * kBlock_px * kSobelNoise * noise;
  cv::Mat sd(left.size(), CV_64FC1);
  for (int y = 0; y < left.rows; ++y) {
    for (int x = 0; x < left.cols; ++x) {
      const double e = energy.at<double>(y, x) - noise_energy;
      sd.at<double>(y, x) =
          e > 0.0 ? std::sqrt(2.0 * noise / e) : std::numeric_limits<double>::infinity();
    }
  }
  return sd;
}

bool seen(const GrayImage& mask, int x, int y) { return mask.empty() || mask.at(x, y) != 0; }

DisparityMap combine(const RectifiedPair& pair, const cv::Mat& from_left, const cv::Mat& from_right,
                     const cv::Mat& bound, const MatchOptions& options) {
  const int width = pair.left.width, height = pair.left.height;
  DisparityMap map{{width, height, kNone}, {width, height, kNone}, 0.0};
  std::size_t visible = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!seen(pair.left_seen, x, y)) continue;
      ++visible;
      const float d = from_left.at<float>(y, x);
      const double shift_sd = bound.at<double>(y, x);
      if (std::isnan(d) || !(shift_sd <= kMaxTextureSd_px)) continue;
      const int partner = static_cast<int>(std::lround(static_cast<double>(x) - d));
      if (partner < 0 || partner >= width || !seen(pair.right_seen, partner, y)) continue;
      const double difference = static_cast<double>(d) - from_right.at<float>(y, partner);
      if (!(std::abs(difference) <= options.max_left_right_px)) continue;
      map.disparity_px.at(x, y) = d;
      map.sd_px.at(x, y) = static_cast<float>(
          std::sqrt(kFloor_px * kFloor_px + shift_sd * shift_sd + 0.5 * difference * difference));
    }
  }
  const auto least = static_cast<int>(options.min_part_fraction * static_cast<double>(visible));
  const int valid = drop_small_parts(map.disparity_px, kMaxStep_px, least).left;
  for (std::size_t i = 0; i < map.sd_px.pixels.size(); ++i)
    if (std::isnan(map.disparity_px.pixels[i])) map.sd_px.pixels[i] = kNone;
  if (visible > 0) map.valid_fraction = static_cast<double>(valid) / static_cast<double>(visible);
  return map;
}

Result<MatchOptions> within(const DepthRange& range, const RectifiedGeometry& geometry, int width,
                            MatchOptions options) {
  if (!(range.near_mm > 0.0) || !(range.far_mm > range.near_mm) || !std::isfinite(range.far_mm)) {
    return invalid(fmt::format("depth range = {} to {} mm: must be 0 < near < far", range.near_mm,
                               range.far_mm));
  }
  // A point nearer than this lies in one picture only.
  const double most = std::min(disparity_at(geometry, range.near_mm), static_cast<double>(width));
  const double least = std::max(disparity_at(geometry, range.far_mm), -static_cast<double>(width));
  if (!(most > least)) {
    return invalid(fmt::format("depth range = {} to {} mm: no point so near lies in both pictures",
                               range.near_mm, range.far_mm));
  }
  options.min_disparity_px = static_cast<int>(std::floor(least)) - 1;
  options.disparities = static_cast<int>(std::ceil(most)) + 2 - options.min_disparity_px;
  return options;
}

Result<MeasuredDisparity> measure(const GrayImage& left, const GrayImage& right,
                                  const StereoCalibration& calibration, const DepthRange& range,
                                  const MatchOptions& options) {
  auto rectified = rectify(left, right, calibration);
  if (!rectified) return tl::unexpected(rectified.error());
  const auto bounded = within(range, rectified->geometry, left.width, options);
  if (!bounded) return tl::unexpected(bounded.error());
  auto map = match(rectified->pair, *bounded);
  if (!map) return tl::unexpected(map.error());
  return MeasuredDisparity{std::move(*map), std::move(rectified->pair), rectified->geometry};
}

}  // namespace

double confidence(double sd_px) { return std::erf(1.0 / (std::numbers::sqrt2 * sd_px)); }

Result<DisparityMap> match(const RectifiedPair& pair, const MatchOptions& options) {
  if (Status ok = check_match(pair, options); !ok) return tl::unexpected(ok.error());
  const cv::Mat left = view_of(pair.left), right = view_of(pair.right);
  const cv::Mat from_left = match_one_way(left, right, options);
  const cv::Mat from_right = match_from_right(left, right, options);
  return combine(pair, from_left, from_right, texture_sd(left), options);
}

Result<MeasuredDisparity> measure_disparity(const GrayImage& left, const GrayImage& right,
                                            const StereoCalibration& calibration,
                                            const DepthRange& range, const MatchOptions& options) {
  auto measured = measure(left, right, calibration, range, options);
  if (!measured || measured->map.valid_fraction >= kMinValid) return measured;
  const double found = measured->map.valid_fraction;
  const auto turned = measure(right, left, calibration, range, options);
  if (turned && turned->map.valid_fraction >= kMinValid &&
      turned->map.valid_fraction >= kSwappedGain * found) {
    return invalid(
        fmt::format("left and right pictures are swapped: {:.1f} % of the pixels match as "
                    "given and {:.1f} % the other way round",
                    100.0 * found, 100.0 * turned->map.valid_fraction));
  }
  return fail(ErrorCode::kEmptySet,
              fmt::format("{:.1f} % of the pixels have a consistent match between {:g} and {:g} "
                          "mm: must be at least {:g} %; too little texture, another depth, or "
                          "another calibration?",
                          100.0 * found, range.near_mm, range.far_mm, 100.0 * kMinValid));
}

}  // namespace brainshift::stereo
