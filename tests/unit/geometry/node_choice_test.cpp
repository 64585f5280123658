// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "common/geometry/node_choice.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::geometry {
namespace {

// The toy patient's tumour is a ball of radius 10 mm at (30, 30, 40).
const Vec3 kTumour(30, 30, 40);
constexpr double kRadius_mm = 10.0;

TEST(RegionNodes, DistancesAreThoseFromTheTumoursSurfaceNegativeInside) {
  const BrainModel model = test_support::toy_patient(6);
  const auto distances = distances_from_tumour(model);
  ASSERT_EQ(distances.size(), static_cast<std::size_t>(model.mesh.num_nodes()));
  int inside = 0;
  for (NodeIndex node = 0; node < model.mesh.num_nodes(); ++node) {
    const double exact = (model.mesh.nodes.col(node) - kTumour).norm() - kRadius_mm;
    EXPECT_NEAR(distances[static_cast<std::size_t>(node)], exact, 0.3);
    inside += exact < 0.0 ? 1 : 0;
  }
  EXPECT_GT(inside, 0);
}

TEST(RegionNodes, AreThoseWithinTheMarginOrTheRadiusAndAscend) {
  const BrainModel model = test_support::toy_patient(6);
  const auto distances = distances_from_tumour(model);
  const auto near = nodes_in_region(model, TumourRegion{8.0}, distances).value();
  const auto ball = nodes_in_region(model, BallRegion{Vec3(10, 20, 30), 15.0}, {}).value();
  const auto brain = nodes_in_region(model, WholeBrain{}, {}).value();
  EXPECT_EQ(static_cast<int>(brain.size()), model.mesh.num_nodes());
  for (const NodeIndex node : brain) {
    const Vec3 x = model.mesh.nodes.col(node);
    const double from_tumour = (x - kTumour).norm() - kRadius_mm;
    if (std::abs(from_tumour - 8.0) > 0.3) {
      EXPECT_EQ(std::count(near.begin(), near.end(), node), from_tumour < 8.0 ? 1 : 0);
    }
    const bool in_ball = (x - Vec3(10, 20, 30)).norm() <= 15.0;
    EXPECT_EQ(std::count(ball.begin(), ball.end(), node), in_ball ? 1 : 0);
  }
  for (const auto& nodes : {near, ball, brain}) {
    EXPECT_TRUE(std::is_sorted(nodes.begin(), nodes.end()));
  }
}

TEST(RegionNodes, ARegionWithoutNodesAndAModelWithoutTumourAreNamed) {
  BrainModel model = test_support::toy_patient(3);
  EXPECT_EQ(refusal_of(nodes_in_region(model, BallRegion{Vec3(500, 0, -1), 40.0}, {}),
                       ErrorCode::kEmptySet),
            "no node lies in the ball of 40 mm about (500, 0, -1) mm");
  model.tumour = {};
  EXPECT_EQ(sentence_of(nodes_in_region(model, TumourRegion{40.0}, distances_from_tumour(model))),
            "the model has no tumour");
}

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
