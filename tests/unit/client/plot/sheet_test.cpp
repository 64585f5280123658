// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/plot/sheet.hpp"

#include <gtest/gtest.h>

#include "tests/unit/client/plot/pixels.hpp"

namespace brainshift::client {
namespace {

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

}  // namespace
}  // namespace brainshift::client
