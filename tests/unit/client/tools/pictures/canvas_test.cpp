// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/canvas.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/client/tools/pictures/pixels.hpp"

namespace brainshift::client {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

cv::Mat blank(int width, int height) { return {height, width, CV_8UC3, palette::kWhite}; }

TEST(Colours, MagnitudeGrowsInLuminance) {
  double last = -1.0;
  for (int i = 0; i <= 20; ++i) {
    const cv::Scalar c = magnitude_colour(i / 20.0);
    const double luminance = 0.0722 * c[0] + 0.7152 * c[1] + 0.2126 * c[2];
    EXPECT_GT(luminance, last);
    last = luminance;
  }
  EXPECT_EQ(magnitude_colour(7.0), magnitude_colour(1.0));
  EXPECT_EQ(magnitude_colour(kNan), magnitude_colour(0.0));
}

TEST(Strokes, FarAwayAndNotFinitePointsAreHarmless) {
  cv::Mat image = blank(50, 50);
  draw_polyline(image, {{0, 0}, {1e12, 1e12}, {kNan, 3}}, {});
  draw_arrow(image, {10, 10}, {kNan, kNan}, {});
  draw_marker(image, {kNan, 10}, Marker::kCircle, palette::kBlack, 5);
  EXPECT_EQ(inked(image).area(), 0) << "nothing of these is drawable";
  draw_arrow(image, {10, 10}, {40, 40}, {});
  EXPECT_GT(inked(image).area(), 0);
}

TEST(Strokes, DashesInkAboutHalfOfTheLine) {
  const auto ink = [](double dash_px) {
    cv::Mat image = blank(450, 50);
    draw_polyline(image, {{25, 25}, {425, 25}}, {palette::kBlack, 3, dash_px});
    return count_colour(image, palette::kBlack, whole(image));
  };
  EXPECT_GT(ink(20.0), 0.45 * ink(0.0));
  EXPECT_LT(ink(20.0), 0.65 * ink(0.0));
}

TEST(Text, IsAlignedAtItsAnchorAndAsWideAsAnnounced) {
  const auto box = [](Align align) {
    cv::Mat image = blank(400, 60);
    draw_text(image, {200, 40}, "mesh", {.align = align});
    return inked(image);
  };
  constexpr int kBearing = 6;  // room that a letter keeps on either side
  const int width = text_width("mesh", {});
  EXPECT_NEAR(box(Align::kLeft).width, width, kBearing);
  EXPECT_NEAR(box(Align::kLeft).x, 200, kBearing);
  EXPECT_NEAR(box(Align::kRight).br().x, 200, kBearing);
  EXPECT_NEAR(box(Align::kCentre).x + box(Align::kCentre).width / 2, 200, kBearing);
}

TEST(Text, VerticalTextIsTheHorizontalOneTurned) {
  cv::Mat flat = blank(200, 200), upright = blank(200, 200);
  draw_text(flat, {100, 100}, "depth (mm)", {.align = Align::kCentre});
  draw_vertical_text(upright, {100, 100}, "depth (mm)");
  EXPECT_NEAR(inked(upright).height, inked(flat).width, 2);
  EXPECT_NEAR(inked(upright).width, inked(flat).height, 2);
}

TEST(ColourBar, RunsFromTheScalesLowColourBelowToItsHighColourAbove) {
  cv::Mat image = blank(300, 300);
  draw_colour_bar(image, {20, 30, 30, 240}, {2.0, 5.0}, "mm", palette::kInk);
  const cv::Vec3b low = image.at<cv::Vec3b>(266, 35), high = image.at<cv::Vec3b>(33, 35);
  for (int c = 0; c < 3; ++c) {  // these pixels lie 3 of 240 from the ends
    EXPECT_NEAR(low[c], pixel_of(magnitude_colour(0.0))[c], 8);
    EXPECT_NEAR(high[c], pixel_of(magnitude_colour(1.0))[c], 8);
  }
  EXPECT_GT(inked(image).br().x, 80) << "ticks and label stand on its right";
}

}  // namespace
}  // namespace brainshift::client
