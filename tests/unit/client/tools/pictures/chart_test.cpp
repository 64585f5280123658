// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/chart.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <regex>

namespace brainshift::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

ChartSpec one_line(const std::vector<double>& y) {
  ChartSpec spec;
  spec.title = "T";
  spec.x.label = "iteration";
  spec.y.label = "misfit (mm)";
  Series series{.legend = "sparse", .colour = palette::kVermillion, .line = true};
  for (std::size_t i = 0; i < y.size(); ++i) {
    series.points.push_back({static_cast<double>(i), y[i]});
  }
  spec.series = {series};
  return spec;
}

int count(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  return static_cast<int>(std::distance(std::sregex_iterator(text.begin(), text.end(), regex), {}));
}

// Centres of the circles below the legend's, in the order in which they are drawn.
std::vector<cv::Point2d> circles(const std::string& svg) {
  std::vector<cv::Point2d> found;
  const std::regex circle("circle cx=\"([0-9.]+)\" cy=\"([0-9.]+)\"");
  for (std::sregex_iterator at(svg.begin(), svg.end(), circle), end; at != end; ++at) {
    found.emplace_back(std::stod((*at)[1]), std::stod((*at)[2]));
  }
  found.erase(found.begin(), found.begin() + std::min<long>(1, static_cast<long>(found.size())));
  return found;
}

TEST(Chart, TheCursorOverAColumnShowsItsValues) {
  ChartSpec spec = one_line({3.0, 1.25});
  spec.series[0].points[1].sd = 0.5;
  spec.series[0].points[1].note = "ius, <good>";
  const std::string svg = draw_chart(spec);
  EXPECT_EQ(count(svg, "<title>"), 2);
  EXPECT_THAT(svg, HasSubstr("<title>iteration: 0\nsparse: 3</title>"));
  EXPECT_THAT(svg, HasSubstr("<title>iteration: 1\nsparse: 1.25 ± 0.5\nius, &lt;good&gt;</title>"));
}

TEST(Chart, TheUprightLabelStaysBesideTheDataAndOffTheLegend) {
  ChartSpec spec = one_line({3.0, 1.25});
  spec.y.label = "motion of the tumour (mm)";
  spec.size = {900, 230};
  const std::string svg = draw_chart(spec);
  const std::regex label(
      "y=\"([0-9.]+)\" text-anchor=\"middle\" fill=\"[^\"]*\" transform=[^>]*>"
      "([^<]*)<");
  std::string words;
  for (std::sregex_iterator at(svg.begin(), svg.end(), label), end; at != end; ++at) {
    const double half = 0.5 * 6.6 * static_cast<double>((*at)[2].length());
    EXPECT_GT(std::stod((*at)[1]) - half, 50.0) << "title and legend end there";
    words += (*at)[2].str() + "|";
  }
  EXPECT_EQ(words, "motion of the|tumour (mm)|");
}

TEST(Chart, LargerValuesStandHigherAndFartherRight) {
  const auto at = circles(draw_chart(one_line({0.0, 5.0})));
  ASSERT_EQ(at.size(), 2u);
  EXPECT_LT(at[1].y, at[0].y - 100.0);
  EXPECT_GT(at[1].x, at[0].x + 100.0);
}

TEST(Chart, AMissingValueInterruptsTheLine) {
  const std::string line = "stroke=\"#d55e00\" stroke-width=\"2\"";
  EXPECT_EQ(count(draw_chart(one_line({1, 1, 1, 1, 1})), line), 1 + 1)
      << "the legend's and its own";
  EXPECT_EQ(count(draw_chart(one_line({1, 1, kGap, 1, 1})), line), 1 + 2);
}

TEST(Chart, SurvivesEmptyAndNotFiniteData) {
  for (const std::vector<double>& y :
       {std::vector<double>{}, {kInfinity}, {kGap, kInfinity}, {0.0, 0.0}}) {
    const std::string svg = draw_chart(one_line(y));
    EXPECT_THAT(svg, AllOf(Not(HasSubstr("nan")), Not(HasSubstr("inf")))) << y.size();
    EXPECT_EQ(circles(svg).size(), y.size() == 2 && y[0] == 0.0 ? 2u : 0u);
  }
}

TEST(Chart, PutsADecadeMoreAsFarUpOnALogarithmicAxis) {
  ChartSpec spec = one_line({0.1, 1.0, 10.0, 0.0, -1.0});
  spec.y.log = true;
  const auto at = circles(draw_chart(spec));
  ASSERT_EQ(at.size(), 3u) << "a logarithm shows neither zero nor less";
  EXPECT_NEAR(at[0].y - at[1].y, at[1].y - at[2].y, 0.2);
}

TEST(Chart, TheRightAxisHasItsOwnScale) {
  ChartSpec spec = one_line({1.0, 2.0, 3.0});
  Series right = spec.series[0];
  right.right_axis = true;
  right.legend = "";
  for (ChartPoint& p : right.points) p.y *= 1000.0;
  spec.series.push_back(right);
  const auto at = circles(draw_chart(spec));
  ASSERT_EQ(at.size(), 6u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(at[i].y, at[i + 3].y, 0.2);
}

TEST(Chart, TextOfOthersIsNoMarkup) {
  ChartSpec spec = one_line({1.0});
  spec.title = "<script>&\"";
  EXPECT_THAT(draw_chart(spec),
              AllOf(Not(HasSubstr("<script>")), HasSubstr("&lt;script&gt;&amp;&quot;")));
}

BarSpec two_bars(std::optional<double> a, std::optional<double> b) {
  BarSpec spec;
  spec.groups = {"tumour"};
  spec.series = {{"contact", palette::kBlue, {a}}, {"fixed", palette::kOrange, {b}}};
  spec.y_max = 110.0;
  return spec;
}

// Of the bar of this colour, not the legend's; 0 without.
double height(const std::string& svg, const std::string& colour) {
  const std::regex box("height=\"([0-9.]+)\" fill=\"" + colour + "\"");
  std::vector<double> heights;
  for (std::sregex_iterator at(svg.begin(), svg.end(), box), end; at != end; ++at) {
    heights.push_back(std::stod((*at)[1]));
  }
  return heights.size() > 1 ? heights[1] : 0.0;
}

TEST(Bars, HeightIsProportionalToTheValueAndTheCursorShowsIt) {
  const std::string svg = draw_bars(two_bars(100.0, 50.0));
  EXPECT_NEAR(height(svg, "#0072b2") / height(svg, "#e69f00"), 2.0, 0.01);
  EXPECT_THAT(svg, HasSubstr("<title>tumour\ncontact: 100.0\nfixed: 50.0</title>"));
}

TEST(Bars, AMissingValueDrawsNoBarAndExtremesAreCut) {
  BarSpec spec = two_bars(-5000.0, std::nullopt);
  spec.y_min = -100.0;
  const std::string svg = draw_bars(spec);
  EXPECT_EQ(height(svg, "#e69f00"), 0.0);
  EXPECT_GT(height(svg, "#0072b2"), 50.0);
  EXPECT_LT(height(svg, "#0072b2"), spec.size.height);
  EXPECT_THAT(svg, HasSubstr("contact: -5000.0"));
}

TEST(Bars, AReferenceIsNamed) {
  BarSpec spec = two_bars(100.0, 50.0);
  spec.reference_legend = "published";
  spec.references = {{96.0}, {std::nullopt}};
  EXPECT_THAT(draw_bars(spec), HasSubstr("published: 96.0"));
}

}  // namespace
}  // namespace brainshift::client
