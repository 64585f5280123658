// SPDX-License-Identifier: GPL-3.0-or-later
// Disparities of pictures whose true disparity is known, and of pictures that are not a pair.
#include "common/stereo/disparity.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "common/core/random.hpp"
#include "tests/support/stereo_scene.hpp"

namespace brainshift::stereo {
namespace {

using test_support::Eye;
using test_support::operating_rig;
using test_support::Patch;
using testing::HasSubstr;

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
    const auto map = match(pair, options_for(-16, 48));
    ASSERT_TRUE(map) << map.error().message;
    // What lies beyond the right picture's edge has no partner.
    EXPECT_GT(map->valid_fraction, 0.85);
    double worst = 0.0;
    for (const float value : map->disparity_px.pixels)
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
  const auto map = match(pair, options);
  ASSERT_TRUE(map);
  EXPECT_GT(valid_between(*map, 40, 75), 0.9) << "the wall";
  EXPECT_GT(valid_between(*map, 106, 154), 0.9) << "the plate";
  EXPECT_LT(valid_between(*map, 84, 96), 0.1) << "hidden from the right camera";
  options.max_left_right_px = 1e9;
  EXPECT_GT(valid_between(*match(pair, options), 84, 96), 0.3) << "else the test shows nothing";
}

TEST(Match, AWhiteWallHasNoDisparity) {
  Random random(9);
  RectifiedPair pair{GrayImage(160, 120), GrayImage(160, 120), {}, {}};
  for (GrayImage* image : {&pair.left, &pair.right})
    for (std::uint8_t& pixel : image->pixels)
      pixel = static_cast<std::uint8_t>(std::lround(150.0 + random.normal()));
  const auto map = match(pair, options_for(0, 32));
  ASSERT_TRUE(map);
  EXPECT_LT(map->valid_fraction, 0.01);
}

TEST(Match, WhatTheOriginalPicturesDoNotShowIsNotValid) {
  RectifiedPair pair{dots(120, 60, 0.0, 4), dots(120, 60, 5.0, 4), GrayImage(120, 60, 1), {}};
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 120; ++x) pair.left_seen.at(x, y) = 0;
  const auto map = match(pair, options_for(0, 16));
  ASSERT_TRUE(map);
  for (int x = 0; x < 120; ++x) EXPECT_TRUE(std::isnan(map->disparity_px.at(x, 20)));
  EXPECT_FALSE(std::isnan(map->disparity_px.at(60, 45)));
  EXPECT_GT(map->valid_fraction, 0.8) << "of what is seen";
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
