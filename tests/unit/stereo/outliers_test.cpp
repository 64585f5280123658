// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/stereo/outliers.hpp"

#include <gtest/gtest.h>

#include <algorithm>

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

}  // namespace
}  // namespace brainshift::stereo
