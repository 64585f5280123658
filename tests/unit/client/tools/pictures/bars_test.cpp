// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/bars.hpp"

#include <gtest/gtest.h>

#include "tests/unit/client/tools/pictures/pixels.hpp"

namespace brainshift::client {
namespace {

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
