// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "client/tools/pictures/canvas.hpp"
#include "client/tools/pictures/sheet.hpp"
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

TEST(Ticks, AreRoundAndWithinTheRange) {
  EXPECT_EQ(nice_ticks(0.0, 1.0, 5), (std::vector<double>{0.0, 0.2, 0.4, 0.2 * 3, 0.8, 1.0}));
  for (const auto& [min, max] : {std::pair{0.0, 3.7}, {-4.0, 131.0}, {0.012, 0.019}, {1e5, 3e5}}) {
    const auto ticks = nice_ticks(min, max);
    ASSERT_GE(ticks.size(), 2u);
    EXPECT_LE(ticks.size(), 12u);
    EXPECT_GE(ticks.front(), min - 1e-9 * max);
    EXPECT_LE(ticks.back(), max * (1 + 1e-9));
    const double step = ticks[1] - ticks[0];
    const double mantissa = step / std::pow(10.0, std::floor(std::log10(step) + 1e-9));
    EXPECT_TRUE(std::abs(mantissa - 1) < 1e-6 || std::abs(mantissa - 2) < 1e-6 ||
                std::abs(mantissa - 5) < 1e-6)
        << step;
  }
}

TEST(Ticks, LabelsShowAsManyDecimalsAsTheStepNeeds) {
  EXPECT_EQ(tick_label(0.30000000000000004, 0.1), "0.3");
  EXPECT_EQ(tick_label(25.0, 5.0), "25");
  EXPECT_EQ(tick_label(0.015, 0.005), "0.015");
  EXPECT_EQ(tick_label(-1e-17, 0.5), "0.0");
}

TEST(LogTicks, EqualRatiosAreEqualLengths) {
  EXPECT_DOUBLE_EQ(axis_fraction(1.0, 1.0, 1e4, true), 0.0);
  EXPECT_NEAR(axis_fraction(10.0, 1.0, 1e4, true), 0.25, 1e-15);
  EXPECT_NEAR(axis_fraction(1e4, 1.0, 1e4, true), 1.0, 1e-15);
  EXPECT_DOUBLE_EQ(axis_fraction(2.5, 0.0, 10.0, false), 0.25);
}

TEST(LogTicks, AreRoundAndWithinTheRange) {
  EXPECT_EQ(log_ticks(0.5, 20000.0), (std::vector<double>{1, 10, 100, 1000, 10000}));
  EXPECT_EQ(log_ticks(0.001, 0.1),
            (std::vector<double>{0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1}));
  for (const auto& [min, max] : {std::pair{1.07, 1.12}, {0.9, 3.1}, {1e-7, 1e5}, {17000, 19000}}) {
    const auto ticks = log_ticks(min, max);
    ASSERT_GE(ticks.size(), 3u) << min;
    EXPECT_GE(ticks.front(), min * (1 - 1e-9));
    EXPECT_LE(ticks.back(), max * (1 + 1e-9));
  }
}

TEST(LogTicks, LabelsAreShort) {
  EXPECT_EQ(log_tick_label(0.002), "0.002");
  EXPECT_EQ(log_tick_label(50.0), "50");
  EXPECT_EQ(log_tick_label(20000.0), "20000");
  EXPECT_EQ(log_tick_label(1e-5), "1e-05");
  EXPECT_EQ(log_tick_label(1e6), "1e+06");
}

cv::Mat panel(int width, int height, const cv::Scalar& colour) {
  return {height, width, CV_8UC3, colour};
}

TEST(Sheet, KeepsEveryPanelWholeAndSideBySide) {
  Sheet sheet;
  sheet.title = "two";
  sheet.panels = {{"left", panel(200, 150, palette::kBlue)},
                  {"right", panel(120, 180, palette::kOrange)}};
  const cv::Mat image = compose(sheet);
  const cv::Rect left = box_of_colour(image, palette::kBlue, whole(image));
  const cv::Rect right = box_of_colour(image, palette::kOrange, whole(image));
  EXPECT_EQ(left.size(), cv::Size(200, 150));
  EXPECT_EQ(right.size(), cv::Size(120, 180));
  EXPECT_GT(right.x, left.br().x);
  EXPECT_EQ(right.y, left.y);
  EXPECT_LE(right.br().x, image.cols);
}

TEST(Sheet, HasRoomForTheColourBarAndTheLegendOnlyWhereTheyAreWanted) {
  Sheet sheet;
  sheet.panels = {{"one", panel(400, 300, palette::kBlue)}};
  const cv::Mat plain = compose(sheet);
  sheet.colour_max = 5.0;
  const cv::Mat with_bar = compose(sheet);
  EXPECT_GT(with_bar.cols, plain.cols);
  EXPECT_EQ(with_bar.rows, plain.rows);
  sheet.legend = {{"outline", {palette::kOrange, 4, 0.0}}};
  const cv::Mat with_legend = compose(sheet);
  EXPECT_GT(with_legend.rows, with_bar.rows);
  EXPECT_GT(count_colour(with_legend, palette::kOrange, whole(with_legend)), 100);
}

// The same words on wide panels, where nothing has to be wrapped, are the measure.
TEST(Sheet, TitleSubtitleAndLegendAreWholeOnNarrowPanels) {
  Sheet sheet;
  sheet.title = "A title that is wider than the panel";
  sheet.subtitle = "a subtitle of many words; it goes on and on, and ends with these words";
  sheet.legend = {{"outline before", {palette::kGreen, 4, 0.0}},
                  {"outline estimated", {palette::kOrange, 4, 0.0}},
                  {"outline true", {palette::kPurple, 4, 0.0}}};
  const auto composed = [&](int width) {
    sheet.panels = {{"", panel(width, 100, palette::kBlue)}};
    return compose(sheet);
  };
  const cv::Mat narrow = composed(100);
  const cv::Mat wide = composed(3000);
  ASSERT_LT(narrow.cols, 1000);
  for (const cv::Scalar& colour : {palette::kGreen, palette::kOrange, palette::kPurple}) {
    EXPECT_EQ(box_of_colour(narrow, colour, whole(narrow)).size(),
              box_of_colour(wide, colour, whole(wide)).size());
  }
  const auto legend_of = [](const cv::Mat& image) {
    cv::Rect strip = box_of_colour(image, palette::kInk, {0, 0, 1, image.rows});
    strip.width = image.cols;
    return image(strip).clone();
  };
  const auto expect_as_much = [](const cv::Scalar& colour, const cv::Mat& a, const cv::Mat& b) {
    const int expected = count_colour(b, colour, whole(b));
    EXPECT_GT(expected, 500);
    // 5 %: the pixels of smoothed letters depend on where a word begins.
    EXPECT_NEAR(count_colour(a, colour, whole(a)), expected, 0.05 * expected);
  };
  expect_as_much(palette::kGrey, narrow, wide);
  expect_as_much(palette::kWhite, legend_of(narrow), legend_of(wide));
  const cv::Rect ink = inked(narrow(cv::Rect(0, 0, narrow.cols, 150)));
  EXPECT_LT(ink.br().x, narrow.cols - 20);
}

}  // namespace
}  // namespace brainshift::client
