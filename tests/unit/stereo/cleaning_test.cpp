// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/stereo/cleaning.hpp"

namespace brainshift::stereo {
namespace {

Points grid_with_strays(int strays) {
  Points points(3, 400 + strays);
  for (int i = 0; i < 400; ++i) points.col(i) = Vec3(i % 20, static_cast<double>(i / 20), 0.0);
  for (int s = 0; s < strays; ++s) points.col(400 + s) = Vec3(5.0 * s, 7.0, 15.0 + 6.0 * s);
  return points;
}

TEST(DistanceOutliers, StraysAboveAGridAreFoundAndNothingElse) {
  const std::vector<bool> outlier = distance_outliers(grid_with_strays(3), 3.0);
  for (std::size_t i = 0; i < outlier.size(); ++i) EXPECT_EQ(outlier[i], i >= 400) << i;
}

TEST(DistanceOutliers, FewPointsHaveNone) {
  Points points = Points::Zero(3, 8);
  points(0, 7) = 1000.0;
  const std::vector<bool> outlier = distance_outliers(points, 1.0, 8);
  EXPECT_EQ(std::count(outlier.begin(), outlier.end(), true), 0);
}

// One character per pixel: a digit is a disparity, a dot is no match.
PixelMap<float> map_of(const std::vector<std::string>& rows) {
  PixelMap<float> map(static_cast<int>(rows[0].size()), static_cast<int>(rows.size()),
                      std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) {
      const char pixel = rows[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
      if (pixel != '.') map.at(x, y) = static_cast<float>(pixel - '0');
    }
  return map;
}

std::vector<std::string> rows_of(const PixelMap<float>& map) {
  std::vector<std::string> rows;
  for (int y = 0; y < map.height; ++y) {
    rows.emplace_back();
    for (int x = 0; x < map.width; ++x)
      rows.back() +=
          std::isnan(map.at(x, y)) ? '.' : static_cast<char>('0' + std::lround(map.at(x, y)));
  }
  return rows;
}

// A part of 6 ones, of 4 nines beside it, and of 2 ones that touch the first by a corner only.
const std::vector<std::string> kThreeParts = {"11199",  //
                                              "11199",  //
                                              "...11"};

TEST(Parts, SmallOnesAreDroppedAndCounted) {
  PixelMap<float> map = map_of(kThreeParts);
  const PartSizes sizes = drop_small_parts(map, 1.0, 3);
  EXPECT_EQ(rows_of(map), (std::vector<std::string>{"11199", "11199", "....."}));
  EXPECT_EQ(sizes.left, 10);
  EXPECT_EQ(sizes.dropped, 2);
  EXPECT_EQ(sizes.largest, 6);
}

TEST(Parts, AFractionOfTheLargestIsTheBound) {
  PixelMap<float> map = map_of(kThreeParts);
  // 0.7 of 6 is 4.2: the part of 4 goes too.
  const PartSizes sizes = drop_minor_parts(map, 1.0, 0.7);
  EXPECT_EQ(rows_of(map), (std::vector<std::string>{"111..", "111..", "....."}));
  EXPECT_EQ(sizes.left, 6);
  EXPECT_EQ(sizes.dropped, 6);
}

TEST(Parts, AStepWithinTheBoundConnects) {
  PixelMap<float> map = map_of(kThreeParts);
  EXPECT_EQ(drop_small_parts(map, 8.0, 3).largest, 12) << "ones, nines and, below them, ones";
  EXPECT_EQ(rows_of(map), kThreeParts);
}

TEST(Parts, OfAMapWithoutAMatchAreNone) {
  PixelMap<float> map = map_of({"...", "..."});
  const PartSizes sizes = drop_minor_parts(map, 1.0, 0.5);
  EXPECT_EQ(sizes.left, 0);
  EXPECT_EQ(sizes.dropped, 0);
  EXPECT_EQ(sizes.largest, 0);
}

}  // namespace
}  // namespace brainshift::stereo
