// SPDX-License-Identifier: GPL-3.0-or-later
// Disparities of pictures whose true disparity is known, and of pictures that are not a pair.
#include <gmock/gmock.h>

#include <cmath>

#include "common/core/random.hpp"
#include "common/stereo/disparity.hpp"
#include "tests/support/results.hpp"
#include "tests/support/stereo_scene.hpp"

namespace brainshift::stereo {
namespace {

// After rectification a point lies in the same row of both pictures, and its disparity gives its
// depth.

using test_support::Eye;
using test_support::operating_rig;
using testing::HasSubstr;

// A picture with a soft white spot where the rig sees the point.
GrayImage spot(const StereoCalibration& rig, Eye eye, const Vec3& x) {
  const Eigen::Vector2d at = test_support::project(rig, eye, x);
  GrayImage image(rig.width_px, rig.height_px);
  for (int v = 0; v < image.height; ++v)
    for (int u = 0; u < image.width; ++u)
      image.at(u, v) = static_cast<std::uint8_t>(
          std::lround(250.0 * std::exp(-0.5 * (Eigen::Vector2d(u, v) - at).squaredNorm() / 6.0)));
  return image;
}

Eigen::Vector2d centroid(const GrayImage& image) {
  double sum = 0.0;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      sum += image.at(u, v);
      at += image.at(u, v) * Eigen::Vector2d(u, v);
    }
  }
  return at / sum;
}

TEST(Rectify, APointLiesInOneRowAndItsDisparityGivesItBack) {
  const StereoCalibration rig = operating_rig();
  for (const Vec3& x : {Vec3(0, 0, 250), Vec3(-35, 20, 230), Vec3(40, -28, 280)}) {
    const auto rectified =
        value_or_fail(rectify(spot(rig, Eye::kLeft, x), spot(rig, Eye::kRight, x), rig));
    const Eigen::Vector2d left = centroid(rectified.pair.left);
    const Eigen::Vector2d right = centroid(rectified.pair.right);
    EXPECT_NEAR(left.y(), right.y(), 0.1);  // of spots rounded to grey levels
    const Vec3 back = triangulate(rectified.geometry, left.x(), left.y(), left.x() - right.x());
    // 0.05 px of disparity are 0.1 mm of depth here.
    EXPECT_LT((back - x).norm(), 0.15) << back.transpose();
  }
}

TEST(Rectify, DepthAndDisparityAreInverse) {
  const RectifiedGeometry g{1000.0, 320.0, 300.0, 240.0, 30.0, Mat3::Identity()};
  EXPECT_DOUBLE_EQ(disparity_at(g, 250.0), 120.0 + 20.0);
  EXPECT_DOUBLE_EQ(depth_at(g, 140.0), 250.0);
  EXPECT_DOUBLE_EQ(depth_sd_mm(g, 140.0, 0.5), 250.0 * 250.0 / 30000.0 * 0.5);
  // Against the slope of the depth.
  EXPECT_NEAR(depth_sd_mm(g, 140.0, 1e-4), depth_at(g, 140.0) - depth_at(g, 140.0001), 1e-9);
  EXPECT_TRUE(triangulate(g, 320.0, 240.0, 140.0).isApprox(Vec3(0, 0, 250)));
  EXPECT_TRUE(triangulate(g, 420.0, 190.0, 140.0).isApprox(Vec3(25, -12.5, 250)));
}

TEST(Rectify, PicturesOfAnotherSizeThanTheCalibrationsAreRefused) {
  const GrayImage good(640, 480), small(320, 240);
  EXPECT_EQ(sentence_of(rectify(small, good, operating_rig())),
            "the left picture has 320 x 240 px: the calibration is for 640 x 480 px");
  EXPECT_THAT(sentence_of(rectify(good, small, operating_rig())),
              HasSubstr("the right picture has 320 x 240 px"));
}

struct BadCalibration {
  const char* name;
  void (*spoil)(StereoCalibration&);
  std::string says;
};
void PrintTo(const BadCalibration& bad, std::ostream* stream) { *stream << bad.name; }
class Calibration : public testing::TestWithParam<BadCalibration> {};

TEST_P(Calibration, ThatCannotBeIsRefused) {
  StereoCalibration rig = operating_rig();
  ASSERT_TRUE(validate(rig));
  GetParam().spoil(rig);
  EXPECT_THAT(sentence_of(rectify(GrayImage(640, 480), GrayImage(640, 480), rig)),
              HasSubstr(GetParam().says));
}

INSTANTIATE_TEST_SUITE_P(
    Table, Calibration,
    testing::Values(
        BadCalibration{"Width", [](StereoCalibration& c) { c.width_px = 0; },
                       "image.width_px = 0: must be between 1 and 16384"},
        BadCalibration{"Height", [](StereoCalibration& c) { c.height_px = -1; },
                       "image.height_px = -1"},
        BadCalibration{"Focal", [](StereoCalibration& c) { c.left.focal_x_px = -3.0; },
                       "left.focal_x_px = -3: must be finite and > 0"},
        BadCalibration{"FocalNan", [](StereoCalibration& c) { c.right.focal_y_px = NAN; },
                       "right.focal_y_px = nan"},
        BadCalibration{"CentreX", [](StereoCalibration& c) { c.right.centre_x_px = 900.0; },
                       "right.centre_x_px = 900: must be inside the picture"},
        BadCalibration{"CentreY", [](StereoCalibration& c) { c.left.centre_y_px = -1.0; },
                       "left.centre_y_px = -1"},
        BadCalibration{"Distortion", [](StereoCalibration& c) { c.left.distortion[4] = 1e5; },
                       "left.distortion[4] = 100000"},
        BadCalibration{"Scaled", [](StereoCalibration& c) { c.T_right_left.linear() *= 1.1; },
                       "T_right_left is no rigid motion: R^T R differs from I by 0.2"},
        BadCalibration{"Mirrored",
                       [](StereoCalibration& c) { c.T_right_left.linear().col(0) *= -1.0; },
                       "reflection"},
        BadCalibration{"NotFinite",
                       [](StereoCalibration& c) { c.T_right_left.translation().x() = NAN; },
                       "T_right_left holds a value that is not a finite number"},
        BadCalibration{"NoBaseline",
                       [](StereoCalibration& c) { c.T_right_left.translation().setZero(); },
                       "baseline mm = 0"},
        BadCalibration{"Above",
                       [](StereoCalibration& c) {
                         c.T_right_left.translation() = c.T_right_left.linear() * Vec3(0, 30, 0);
                       },
                       "do not stand side by side"},
        BadCalibration{"Swapped",
                       [](StereoCalibration& c) { c.T_right_left = c.T_right_left.inverse(); },
                       "left and right are swapped"}),
    [](const auto& row) { return std::string(row.param.name); });

using test_support::Patch;

// Random dots, blurred along the row so that they can be shifted by parts of a pixel.
GrayImage dots(int width, int height, double shift, std::uint64_t seed) {
  Random random(seed);
  const int margin = 64;
  PixelMap<double> wide(width + 2 * margin, height);
  for (double& value : wide.pixels) value = 255.0 * random.uniform();
  GrayImage image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double at = x + margin + shift;
      double sum = 0.0, weights = 0.0;
      for (int k = static_cast<int>(at) - 5; k <= static_cast<int>(at) + 6; ++k) {
        const double w = std::exp(-0.5 * (k - at) * (k - at) / 2.0);
        sum += w * wide.at(k, y);
        weights += w;
      }
      image.at(x, y) = static_cast<std::uint8_t>(std::lround(sum / weights));
    }
  }
  return image;
}

MatchOptions options_for(int least, int count) {
  MatchOptions options;
  options.min_disparity_px = least;
  options.disparities = count;
  return options;
}

TEST(Match, AShiftedPictureHasThatDisparity) {
  // x_right = x_left - d: the right picture shows at x what the left shows at x + d.
  for (const double d : {0.0, 7.0, 12.25, 12.5, -9.75}) {
    const RectifiedPair pair{dots(200, 80, 0.0, 3), dots(200, 80, d, 3), {}, {}};
    const auto map = value_or_fail(match(pair, options_for(-16, 48)));
    // What lies beyond the right picture's edge has no partner.
    EXPECT_GT(map.valid_fraction, 0.85);
    double worst = 0.0;
    for (const float value : map.disparity_px.pixels)
      if (!std::isnan(value)) worst = std::max(worst, std::abs(static_cast<double>(value) - d));
    EXPECT_LT(worst, 0.75) << d;
  }
}

// A near plate (disparity 24) before a far wall (4). Only the left camera sees a strip of the wall
// beside the plate.
TEST(Match, WhatOneCameraAloneSeesIsNotValid) {
  RectifiedPair pair{dots(220, 80, 0.0, 11), dots(220, 80, 4.0, 11), {}, {}};
  const GrayImage plate_left = dots(220, 80, 0.0, 12), plate_right = dots(220, 80, 24.0, 12);
  for (int y = 0; y < 80; ++y) {
    for (int x = 100; x < 160; ++x) {
      pair.left.at(x, y) = plate_left.at(x, y);
      pair.right.at(x - 24, y) = plate_right.at(x - 24, y);
    }
  }
  const auto valid_between = [&](const DisparityMap& map, int from, int to) {
    int valid = 0;
    for (int y = 5; y < 75; ++y)
      for (int x = from; x < to; ++x) valid += !std::isnan(map.disparity_px.at(x, y));
    return static_cast<double>(valid) / (70.0 * (to - from));
  };
  MatchOptions options = options_for(0, 32);
  options.uniqueness_percent = 0;   // the two other tests of a match
  options.min_part_fraction = 0.0;  // shall not help
  const auto map = value_or_fail(match(pair, options));
  EXPECT_GT(valid_between(map, 40, 75), 0.9) << "the wall";
  EXPECT_GT(valid_between(map, 106, 154), 0.9) << "the plate";
  EXPECT_LT(valid_between(map, 84, 96), 0.1) << "hidden from the right camera";
  options.max_left_right_px = 1e9;
  EXPECT_GT(valid_between(*match(pair, options), 84, 96), 0.3) << "else the test shows nothing";
}

TEST(Match, AWhiteWallHasNoDisparity) {
  Random random(9);
  RectifiedPair pair{GrayImage(160, 120), GrayImage(160, 120), {}, {}};
  for (GrayImage* image : {&pair.left, &pair.right})
    for (std::uint8_t& pixel : image->pixels)
      pixel = static_cast<std::uint8_t>(std::lround(150.0 + random.normal()));
  const auto map = value_or_fail(match(pair, options_for(0, 32)));
  EXPECT_LT(map.valid_fraction, 0.01);
}

TEST(Match, WhatTheOriginalPicturesDoNotShowIsNotValid) {
  RectifiedPair pair{dots(120, 60, 0.0, 4), dots(120, 60, 5.0, 4), GrayImage(120, 60, 1), {}};
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 120; ++x) pair.left_seen.at(x, y) = 0;
  const auto map = value_or_fail(match(pair, options_for(0, 16)));
  for (int x = 0; x < 120; ++x) EXPECT_TRUE(std::isnan(map.disparity_px.at(x, 20)));
  EXPECT_FALSE(std::isnan(map.disparity_px.at(60, 45)));
  EXPECT_GT(map.valid_fraction, 0.8) << "of what is seen";
}

TEST(Match, ConfidenceIsAProbability) {
  EXPECT_NEAR(confidence(1.0), 0.6827, 1e-4);
  EXPECT_NEAR(confidence(0.5), 0.9545, 1e-4);
  EXPECT_LT(confidence(5.0), 0.2);
}

TEST(Match, BadOptionsAndPicturesAreNamed) {
  const RectifiedPair good{GrayImage(40, 40), GrayImage(40, 40), {}, {}};
  const auto match_refusal = [](const RectifiedPair& pair, const MatchOptions& options) {
    const auto map = match(pair, options);
    return map ? "no refusal" : map.error().message;
  };
  MatchOptions options;
  options.disparities = 0;
  EXPECT_EQ(match_refusal(good, options), "disparities = 0: must be between 1 and 2048");
  options = {};
  options.max_left_right_px = NAN;
  EXPECT_EQ(match_refusal(good, options), "max_left_right_px = nan: must be > 0");
  EXPECT_EQ(match_refusal({GrayImage(40, 40), GrayImage(41, 40), {}, {}}, {}),
            "the left picture has 40 x 40 px, the right one 41 x 40 px: must be equal and not "
            "empty");
  EXPECT_THAT(match_refusal({}, {}), HasSubstr("0 x 0 px"));
}

std::string match_refusal(const GrayImage& left, const GrayImage& right,
                          const DepthRange& range = {}) {
  const auto measured = measure_disparity(left, right, operating_rig(), range);
  return measured ? "no refusal" : measured.error().message;
}

TEST(MeasureDisparity, SwappedPicturesAreToldFromBadOnes) {
  const StereoCalibration rig = operating_rig();
  const GrayImage left = render(rig, Eye::kLeft, Patch{}, 1);
  const GrayImage right = render(rig, Eye::kRight, Patch{}, 2);
  EXPECT_EQ(match_refusal(left, right), "no refusal");
  EXPECT_THAT(match_refusal(right, left), HasSubstr("left and right pictures are swapped"));
}

TEST(MeasureDisparity, WithoutTextureNothingMatches) {
  const StereoCalibration rig = operating_rig();
  Patch wall;
  wall.contrast = 0.0;
  EXPECT_THAT(match_refusal(render(rig, Eye::kLeft, wall, 1), render(rig, Eye::kRight, wall, 2)),
              HasSubstr("have a consistent match between 100 and 600 mm: must be at least 10 %"));
}

TEST(MeasureDisparity, AnotherDepthThanTheSurfacesIsRefused) {
  const StereoCalibration rig = operating_rig();
  EXPECT_THAT(match_refusal(render(rig, Eye::kLeft, Patch{}, 1),
                            render(rig, Eye::kRight, Patch{}, 2), {400.0, 500.0}),
              HasSubstr("have a consistent match between 400 and 500 mm"));
  EXPECT_THAT(match_refusal(GrayImage(640, 480), GrayImage(640, 480), {400.0, 300.0}),
              HasSubstr("depth range = 400 to 300 mm: must be 0 < near < far"));
  EXPECT_THAT(match_refusal(GrayImage(640, 480), GrayImage(640, 480), {1.0, 2.0}),
              HasSubstr("no point so near lies in both pictures"));
}

}  // namespace
}  // namespace brainshift::stereo
