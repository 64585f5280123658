// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/operators/spatial_blocks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "common/core/random.hpp"

namespace brainshift {
namespace {

Points scattered_points(int n) {
  Random random(5);
  Points points(3, n);
  for (double& x : points.reshaped()) x = 100.0 * random.uniform();
  return points;
}

double extent_mm(const Points& points, std::span<const int> block) {
  Vec3 low = points.col(block.front()), high = low;
  for (const int i : block) {
    low = low.cwiseMin(points.col(i));
    high = high.cwiseMax(points.col(i));
  }
  return (high - low).maxCoeff();
}

TEST(SpatialBlocks, HoldEveryPointOnceInBlocksOfAboutTheSameSize) {
  for (const int n : {0, 1, 2, 63, 64, 65, 129, 1000}) {
    const SpatialBlocks blocks = spatial_blocks(scattered_points(n), 64);
    EXPECT_EQ(blocks.size(), (n + 63) / 64);
    std::vector<int> all;
    for (int b = 0; b < blocks.size(); ++b) {
      EXPECT_LE(blocks.block(b).size(), 64u);
      EXPECT_GE(2 * blocks.block(b).size() + 2, static_cast<std::size_t>(std::min(n, 64)));
      all.insert(all.end(), blocks.block(b).begin(), blocks.block(b).end());
    }
    EXPECT_EQ(all, blocks.order);
    std::sort(all.begin(), all.end());
    std::vector<int> expected(static_cast<std::size_t>(n));
    std::iota(expected.begin(), expected.end(), 0);
    EXPECT_EQ(all, expected);
  }
}

TEST(SpatialBlocks, AreOfNeighbours) {
  const Points points = scattered_points(4096);  // 64 blocks: a cube of 100 in parts of 25 at best
  const SpatialBlocks blocks = spatial_blocks(points, 64);
  for (int b = 0; b < blocks.size(); ++b) EXPECT_LT(extent_mm(points, blocks.block(b)), 35.0);
}

TEST(SpatialBlocks, OfPointsInOnePlaceAreStillOfTheSizeAskedFor) {
  const SpatialBlocks blocks = spatial_blocks(Points::Ones(3, 10), 4);
  EXPECT_EQ(blocks.first, (std::vector<int>{0, 3, 6, 10}));
  EXPECT_EQ(spatial_blocks(Points::Ones(3, 3), 1).order.size(), 3u);
}

}  // namespace
}  // namespace brainshift
