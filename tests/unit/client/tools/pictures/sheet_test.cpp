// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/sheet.hpp"

#include <gtest/gtest.h>

#include "tests/unit/client/tools/pictures/pixels.hpp"

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
