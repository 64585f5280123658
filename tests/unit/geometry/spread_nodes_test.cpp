// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/spread_nodes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/toy_patient.hpp"

namespace brainshift::geometry {
namespace {

TEST(SpreadNodes, AreDistinctAndEachTheFarthestFromThoseBefore) {
  const Points nodes = test_support::toy_patient().mesh.nodes;
  const auto chosen = spread_nodes(nodes, 40);
  ASSERT_EQ(chosen.size(), 40u);
  EXPECT_EQ(chosen.front(), 0);
  const auto distance = [&](NodeIndex node, std::size_t before) {
    double least = 1e9;
    for (std::size_t i = 0; i < before; ++i) {
      least = std::min(least, (nodes.col(node) - nodes.col(chosen[i])).norm());
    }
    return least;
  };
  for (std::size_t i = 1; i < chosen.size(); ++i) {
    const double own = distance(chosen[i], i);
    EXPECT_GT(own, 0.0);
    for (int other = 0; other < nodes.cols(); ++other) EXPECT_GE(own, distance(other, i) - 1e-12);
  }
  EXPECT_EQ(spread_nodes(nodes, 1 << 20).size(), static_cast<std::size_t>(nodes.cols()));
  EXPECT_TRUE(spread_nodes(Points(3, 0), 5).empty());
}

TEST(Interpolation, HasWeightsOfSumOneAndGivesASourceItsOwnValue) {
  const Points nodes = test_support::toy_patient().mesh.nodes;
  const Points sources = nodes(Eigen::all, spread_nodes(nodes, 30));
  const Interpolation all = interpolate(sources, nodes);
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    EXPECT_NEAR(all.weights.col(i).sum(), 1.0F, 1e-6F);
    EXPECT_GE(all.weights.col(i).minCoeff(), 0.0F);
  }
  const Interpolation own = interpolate(sources, sources);
  for (Eigen::Index i = 0; i < sources.cols(); ++i) {
    EXPECT_EQ(own.neighbours(0, i), i);
    EXPECT_GT(own.weights(0, i), 0.9999F);
  }
  const Interpolation few = interpolate(sources.leftCols(2), sources);
  EXPECT_NEAR(few.weights.col(7).head<2>().sum(), 1.0F, 1e-6F);
}

}  // namespace
}  // namespace brainshift::geometry
