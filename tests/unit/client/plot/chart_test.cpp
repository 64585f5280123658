// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/plot/chart.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace brainshift::client {
namespace {

// Bounding box of the pixels that differ from white.
cv::Rect inked(const cv::Mat& image) {
  cv::Rect box;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      if (image.at<cv::Vec3b>(y, x) != cv::Vec3b(255, 255, 255)) box |= cv::Rect(x, y, 1, 1);
    }
  }
  return box;
}

int count_colour(const cv::Mat& image, const cv::Scalar& colour, const cv::Rect& within) {
  const cv::Vec3b wanted(cv::saturate_cast<std::uint8_t>(colour[0]),
                         cv::saturate_cast<std::uint8_t>(colour[1]),
                         cv::saturate_cast<std::uint8_t>(colour[2]));
  int count = 0;
  for (int y = within.y; y < within.y + within.height; ++y) {
    for (int x = within.x; x < within.x + within.width; ++x)
      count += image.at<cv::Vec3b>(y, x) == wanted ? 1 : 0;
  }
  return count;
}

ChartSpec one_line(std::vector<double> y) {
  ChartSpec spec;
  spec.title = "T";
  spec.x_label = "iteration";
  spec.left_label = "misfit (mm)";
  Series series;
  series.legend = "line";
  series.colour = palette::kVermillion;
  for (std::size_t i = 0; i < y.size(); ++i) series.x.push_back(static_cast<double>(i));
  series.y = std::move(y);
  spec.series = {series};
  return spec;
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

TEST(Chart, DrawsItsLineInsideTheDataAreaOnly) {
  cv::Rect area;
  const cv::Mat chart = draw_chart(one_line({3.0, 1.0, 0.0, 2.0}), &area);
  constexpr int kRim = 10;
  const cv::Rect rim(area.x - kRim, area.y - kRim, area.width + 2 * kRim, area.height + 2 * kRim);
  EXPECT_GT(count_colour(chart, palette::kVermillion, area), 1000);
  const int everywhere =
      count_colour(chart, palette::kVermillion, cv::Rect(0, 0, chart.cols, chart.rows));
  const int legend = count_colour(chart, palette::kVermillion, cv::Rect(0, 0, chart.cols, rim.y));
  EXPECT_GT(legend, 0);
  EXPECT_EQ(everywhere, count_colour(chart, palette::kVermillion, rim) + legend);
}

TEST(Chart, LeavesAMarginFreeOnEverySide) {
  const cv::Mat chart = draw_chart(one_line({0.5, 12345.0}));
  const cv::Rect box = inked(chart);
  EXPECT_GE(box.x, 10);
  EXPECT_GE(box.y, 10);
  EXPECT_LE(box.x + box.width, chart.cols - 10);
  EXPECT_LE(box.y + box.height, chart.rows - 10);
}

TEST(Chart, MissingValueInterruptsTheLine) {
  cv::Rect area;
  const double gap = std::numeric_limits<double>::quiet_NaN();
  const cv::Mat whole = draw_chart(one_line({1, 1, 1, 1, 1}), &area);
  const cv::Mat broken = draw_chart(one_line({1, 1, gap, 1, 1}));
  const cv::Rect middle(area.x + area.width / 2 - 100, area.y, 200, area.height);
  EXPECT_GT(count_colour(whole, palette::kVermillion, middle), 0);
  EXPECT_EQ(count_colour(broken, palette::kVermillion, middle), 0);
}

TEST(Chart, LargerValuesStandHigher) {
  cv::Rect area;
  const cv::Mat chart = draw_chart(one_line({0.0, 5.0}), &area);
  const cv::Rect lower_left(area.x, area.y + area.height / 2, area.width / 2, area.height / 2);
  const cv::Rect upper_right(area.x + area.width / 2, area.y, area.width / 2, area.height / 2);
  const cv::Rect upper_left(area.x, area.y, area.width / 2 - 40, area.height / 2 - 40);
  EXPECT_GT(count_colour(chart, palette::kVermillion, lower_left), 0);
  EXPECT_GT(count_colour(chart, palette::kVermillion, upper_right), 0);
  EXPECT_EQ(count_colour(chart, palette::kVermillion, upper_left), 0);
}

TEST(Chart, SurvivesEmptyAndNotFiniteData) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(draw_chart(one_line({})).empty());
  EXPECT_FALSE(draw_chart(one_line({infinity})).empty());
  EXPECT_FALSE(draw_chart(one_line({0.0, 0.0})).empty());
}

BarSpec two_bars(std::optional<double> a, std::optional<double> b) {
  BarSpec spec;
  spec.groups = {"tumour"};
  spec.series = {{"contact", palette::kBlue, {a}}, {"fixed", palette::kOrange, {b}}};
  spec.y_max = 110.0;
  return spec;
}

TEST(Bars, HeightIsProportionalToTheValue) {
  cv::Rect area;
  const cv::Mat image = draw_bars(two_bars(100.0, 50.0), &area);
  const cv::Rect upper(area.x, area.y, area.width, area.height / 2 - 20);
  EXPECT_GT(count_colour(image, palette::kBlue, upper), 0);
  EXPECT_EQ(count_colour(image, palette::kOrange, upper), 0);
  const double ratio = static_cast<double>(count_colour(image, palette::kBlue, area)) /
                       count_colour(image, palette::kOrange, area);
  EXPECT_NEAR(ratio, 2.0, 0.1);
}

TEST(Bars, MissingValueDrawsNoBarAndExtremesStayInside) {
  cv::Rect area;
  BarSpec spec = two_bars(-5000.0, std::nullopt);
  spec.y_min = -100.0;
  const cv::Mat image = draw_bars(spec, &area);
  EXPECT_EQ(count_colour(image, palette::kOrange, area), 0);
  const cv::Rect below(0, area.y + area.height + 2, image.cols,
                       image.rows - area.y - area.height - 2);
  EXPECT_EQ(count_colour(image, palette::kBlue, below), 0);
}

TEST(Colours, MagnitudeGrowsInLuminance) {
  double last = -1.0;
  for (int i = 0; i <= 20; ++i) {
    const cv::Scalar c = magnitude_colour(i / 20.0);
    const double luminance = 0.0722 * c[0] + 0.7152 * c[1] + 0.2126 * c[2];
    EXPECT_GT(luminance, last);
    last = luminance;
  }
  EXPECT_EQ(magnitude_colour(7.0), magnitude_colour(1.0));
  EXPECT_EQ(magnitude_colour(std::numeric_limits<double>::quiet_NaN()), magnitude_colour(0.0));
}

TEST(Strokes, FarAwayAndNotFinitePointsAreHarmless) {
  cv::Mat image(50, 50, CV_8UC3, palette::kWhite);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  draw_polyline(image, {{0, 0}, {1e12, 1e12}, {nan, 3}}, {});
  draw_arrow(image, {10, 10}, {nan, nan}, {});
  EXPECT_EQ(inked(image).area(), 0) << "nothing of these is drawable";
}

TEST(Strokes, DashesInkAboutHalfOfTheLine) {
  const auto ink = [](double dash_px) {
    cv::Mat image(50, 450, CV_8UC3, palette::kWhite);
    draw_polyline(image, {{25, 25}, {425, 25}}, {palette::kBlack, 3, dash_px});
    return count_colour(image, palette::kBlack, cv::Rect(0, 0, 450, 50));
  };
  EXPECT_GT(ink(20.0), 0.45 * ink(0.0));
  EXPECT_LT(ink(20.0), 0.65 * ink(0.0));
}

}  // namespace
}  // namespace brainshift::client
