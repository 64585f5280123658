// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <limits>

#include "client/tools/pictures/chart.hpp"
#include "tests/unit/client/tools/pictures/pixels.hpp"

namespace brainshift::client {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Series line_of(const std::vector<double>& y, const cv::Scalar& colour = palette::kVermillion) {
  Series series{"line", colour, Marker::kCircle, true, 0.0, {}};
  for (std::size_t i = 0; i < y.size(); ++i)
    series.points.push_back({static_cast<double>(i), y[i], ""});
  return series;
}

ChartSpec one_line(const std::vector<double>& y) {
  ChartSpec spec;
  spec.title = "T";
  spec.x.label = "iteration";
  spec.y.label = "misfit (mm)";
  spec.series = {line_of(y)};
  return spec;
}

ChartSpec log_points(std::vector<ChartPoint> points) {
  ChartSpec spec;
  spec.x = {"time (ms)", true};
  spec.y = {"error (mm)", true};
  Series series;
  series.colour = palette::kVermillion;
  series.points = std::move(points);
  spec.series.push_back(std::move(series));
  return spec;
}

TEST(Chart, DrawsItsLineInsideTheDataAreaOnly) {
  cv::Rect area;
  const cv::Mat chart = draw_chart(one_line({3.0, 1.0, 0.0, 2.0}), &area);
  constexpr int kRim = kMarkerRadius + 1;  // a marker's radius and its middle
  const cv::Rect rim(area.x - kRim, area.y - kRim, area.width + 2 * kRim, area.height + 2 * kRim);
  EXPECT_GT(count_colour(chart, palette::kVermillion, area), 1000);
  const int everywhere = count_colour(chart, palette::kVermillion, whole(chart));
  const int legend = count_colour(chart, palette::kVermillion, cv::Rect(0, 0, chart.cols, rim.y));
  EXPECT_GT(legend, 0);
  EXPECT_EQ(everywhere, count_colour(chart, palette::kVermillion, rim) + legend);
}

TEST(Chart, LeavesAMarginFreeOnEverySide) {
  ChartSpec spec = one_line({0.5, 12345.0});
  spec.right.label = "nodes";
  spec.series.push_back(line_of({1.0, 98765.0}, palette::kGreen));
  spec.series.back().right_axis = true;
  const cv::Mat chart = draw_chart(spec);
  const cv::Rect box = inked(chart);
  EXPECT_GE(box.x, 10);
  EXPECT_GE(box.y, 10);
  EXPECT_LE(box.br().x, chart.cols - 10);
  EXPECT_LE(box.br().y, chart.rows - 10);
}

TEST(Chart, MissingValueInterruptsTheLine) {
  cv::Rect area;
  const cv::Mat unbroken = draw_chart(one_line({1, 1, 1, 1, 1}), &area);
  const cv::Mat broken = draw_chart(one_line({1, 1, kGap, 1, 1}));
  const cv::Rect middle(area.x + area.width / 2 - 100, area.y, 200, area.height);
  EXPECT_GT(count_colour(unbroken, palette::kVermillion, middle), 0);
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

// Equal shapes on axes that differ by a factor of a thousand cover each other.
TEST(Chart, TheRightAxisHasItsOwnScale) {
  ChartSpec spec = one_line({1.0, 2.0, 3.0});
  cv::Rect area;
  const cv::Rect left = box_of_colour(draw_chart(spec, &area), palette::kVermillion, area);
  spec.series.push_back(line_of({1000.0, 2000.0, 3000.0}, palette::kGreen));
  spec.series.back().right_axis = true;
  const cv::Mat both = draw_chart(spec, &area);
  const cv::Rect right = box_of_colour(both, palette::kGreen, area);
  ASSERT_GT(left.area(), 0);
  EXPECT_NEAR(right.y, left.y, 2);
  EXPECT_NEAR(right.height, left.height, 2);
  const cv::Rect beyond(area.br().x + 12, 0, both.cols - area.br().x - 12, both.rows);
  EXPECT_GT(count_colour(both, palette::kGreen, beyond), 100) << "its labels are in its colour";
}

TEST(Chart, AnAxisThatCountsHasWholeTicks) {
  ChartSpec spec = one_line({1.0, 1.0});  // x from 0 to 1: ticks 0.2 apart otherwise
  cv::Rect area;
  const auto grid_lines = [&](const cv::Mat& chart) {
    int count = 0;
    for (int x = area.x + 4; x < area.br().x - 4; ++x) {
      const auto pale = pixel_of(palette::kPale);
      const int y = area.y + 4;  // above every other mark
      count += chart.at<cv::Vec3b>(y, x) == pale && chart.at<cv::Vec3b>(y, x - 1) != pale ? 1 : 0;
    }
    return count;
  };
  EXPECT_EQ(grid_lines(draw_chart(spec, &area)), 5);
  spec.x.counts = true;
  EXPECT_EQ(grid_lines(draw_chart(spec, &area)), 1);
}

TEST(Chart, SurvivesEmptyAndNotFiniteData) {
  for (const std::vector<double>& y :
       {std::vector<double>{}, {kInfinity}, {kGap, kInfinity}, {0.0, 0.0}}) {
    cv::Rect area;
    const cv::Mat chart = draw_chart(one_line(y), &area);
    ASSERT_EQ(chart.size(), ChartSpec{}.size);
    const bool finite = y.size() == 2 && y[0] == 0.0;
    EXPECT_EQ(count_colour(chart, palette::kVermillion, area) > 0, finite) << y.size();
  }
}

TEST(Chart, ALongLegendTakesMoreRowsAndPushesTheDataAreaDown) {
  ChartSpec spec = one_line({1.0, 2.0});
  cv::Rect one, many;
  draw_chart(spec, &one);
  for (int i = 0; i < 20; ++i) spec.series.push_back(line_of({1.0, 2.0}));
  const cv::Mat chart = draw_chart(spec, &many);
  EXPECT_GT(many.y, one.y);
  EXPECT_LE(inked(chart).br().x, chart.cols - 10);
}

TEST(Chart, PutsADecadeMoreAsFarUpAsRight) {
  cv::Rect area;
  const cv::Mat image = draw_chart(log_points({{1.0, 1.0, ""}, {10.0, 10.0, ""}}), &area);
  const cv::Rect both = box_of_colour(image, palette::kVermillion, area);
  ASSERT_GT(both.area(), 0);
  // The two markers span the same share of both axes, which are padded alike.
  EXPECT_NEAR(static_cast<double>(both.width - 2 * kMarkerRadius) / area.width,
              static_cast<double>(both.height - 2 * kMarkerRadius) / area.height, 0.01);
  EXPECT_GT(both.width, area.width / 2);
}

TEST(Chart, LeavesOutWhatALogarithmCannotShow) {
  cv::Rect area;
  const auto ink = [&](std::vector<ChartPoint> points) {
    const cv::Mat image = draw_chart(log_points(std::move(points)), &area);
    return box_of_colour(image, palette::kVermillion, area).area();
  };
  EXPECT_EQ(ink({{0.0, 1.0, "a"}, {1.0, -1.0, "b"}, {kGap, 1.0, "c"}}), 0);
  EXPECT_GT(ink({{0.0, 1.0, "a"}, {1.0, 1.0, "b"}}), 0);
}

TEST(Chart, LabelsOfEqualPointsDoNotCoverEachOther) {
  cv::Rect area;
  ChartSpec spec = log_points({{1.0, 1.0, "aaa"}, {1.0, 1.0, "bbb"}, {2.0, 2.0, ""}});
  const cv::Rect left_half(0, 0, 900, 1000);
  const cv::Rect two = box_of_colour(draw_chart(spec), palette::kVermillion, left_half);
  spec.series[0].points[1].label.clear();
  const cv::Rect one = box_of_colour(draw_chart(spec, &area), palette::kVermillion, left_half);
  EXPECT_GT(two.area(), one.area());
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
  EXPECT_GT(count_colour(image, palette::kBlue, area), 0);
  const cv::Rect below(0, area.y + area.height + 2, image.cols,
                       image.rows - area.y - area.height - 2);
  EXPECT_EQ(count_colour(image, palette::kBlue, below), 0);
}

TEST(Bars, AReferenceIsABlackTickAtItsHeight) {
  cv::Rect area;
  BarSpec spec = two_bars(100.0, 50.0);
  spec.references = {{55.0}, {std::nullopt}};  // the middle of 0 to 110
  spec.figures = false;
  const cv::Mat image = draw_bars(spec, &area);
  const cv::Rect tick = box_of_colour(image, palette::kBlack, area);
  ASSERT_GT(tick.area(), 0);
  EXPECT_NEAR(tick.y + tick.height / 2, area.y + area.height / 2, 3);
  EXPECT_LT(tick.height, 8);
  EXPECT_LT(tick.br().x, area.x + area.width / 2 + 2) << "the second bar has no reference";
}

}  // namespace
}  // namespace brainshift::client
