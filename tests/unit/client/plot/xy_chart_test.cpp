// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/plot/xy_chart.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace brainshift::client {
namespace {

cv::Rect box_of(const cv::Mat& image, const cv::Scalar& colour, const cv::Rect& within) {
  const cv::Vec3b wanted(static_cast<std::uint8_t>(colour[0]), static_cast<std::uint8_t>(colour[1]),
                         static_cast<std::uint8_t>(colour[2]));
  cv::Rect box;
  for (int y = within.y; y < within.y + within.height; ++y) {
    for (int x = within.x; x < within.x + within.width; ++x) {
      if (image.at<cv::Vec3b>(y, x) == wanted) box |= cv::Rect(x, y, 1, 1);
    }
  }
  return box;
}

XyChartSpec of_points(std::vector<XyPoint> points) {
  XyChartSpec spec;
  spec.x = {std::string("time (ms)"), true};
  spec.y = {std::string("error (mm)"), true};
  XySeries series;
  series.colour = palette::kVermillion;
  series.points = std::move(points);
  spec.series.push_back(std::move(series));
  return spec;
}

TEST(LogAxis, EqualRatiosAreEqualLengths) {
  EXPECT_DOUBLE_EQ(axis_fraction(1.0, 1.0, 1e4, true), 0.0);
  EXPECT_NEAR(axis_fraction(10.0, 1.0, 1e4, true), 0.25, 1e-15);
  EXPECT_NEAR(axis_fraction(1e4, 1.0, 1e4, true), 1.0, 1e-15);
  EXPECT_DOUBLE_EQ(axis_fraction(2.5, 0.0, 10.0, false), 0.25);
}

TEST(LogAxis, TicksAreRoundAndWithinTheRange) {
  EXPECT_EQ(log_ticks(0.5, 20000.0), (std::vector<double>{1, 10, 100, 1000, 10000}));
  EXPECT_EQ(log_ticks(0.001, 0.1),
            (std::vector<double>{0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1}));
  for (const auto& [min, max] : {std::pair{1.07, 1.12}, {0.9, 3.1}, {1e-7, 1e5}, {17000, 19000}}) {
    const auto ticks = log_ticks(min, max);
    EXPECT_GE(ticks.size(), 3u) << min;
    EXPECT_GE(ticks.front(), min * (1 - 1e-9));
    EXPECT_LE(ticks.back(), max * (1 + 1e-9));
  }
}

TEST(LogAxis, LabelsAreShort) {
  EXPECT_EQ(log_tick_label(0.002), "0.002");
  EXPECT_EQ(log_tick_label(50.0), "50");
  EXPECT_EQ(log_tick_label(20000.0), "20000");
}

TEST(XyChart, PutsADecadeMoreAsFarUpAsRight) {
  cv::Rect area;
  const cv::Mat image = draw_xy_chart(of_points({{1.0, 1.0, ""}, {10.0, 10.0, ""}}), &area);
  const cv::Rect both = box_of(image, palette::kVermillion, area);
  ASSERT_GT(both.area(), 0);
  // The two markers span the same share of both axes, which are padded alike.
  EXPECT_NEAR(static_cast<double>(both.width - 20) / area.width,
              static_cast<double>(both.height - 20) / area.height, 0.01);
  EXPECT_GT(both.width, area.width / 2);
}

TEST(XyChart, LeavesOutWhatALogarithmCannotShow) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  cv::Rect area;
  const cv::Mat image =
      draw_xy_chart(of_points({{0.0, 1.0, "a"}, {1.0, -1.0, "b"}, {none, 1.0, "c"}}), &area);
  EXPECT_EQ(box_of(image, palette::kVermillion, area).area(), 0);
}

TEST(XyChart, LabelsOfEqualPointsDoNotCoverEachOther) {
  cv::Rect area;
  auto spec = of_points({{1.0, 1.0, "aaa"}, {1.0, 1.0, "bbb"}, {2.0, 2.0, ""}});
  const cv::Rect two = box_of(draw_xy_chart(spec), palette::kVermillion, cv::Rect(0, 0, 900, 1000));
  spec.series[0].points[1].label.clear();
  const cv::Rect one =
      box_of(draw_xy_chart(spec, &area), palette::kVermillion, cv::Rect(0, 0, 900, 1000));
  EXPECT_GT(two.area(), one.area());
}

}  // namespace
}  // namespace brainshift::client
