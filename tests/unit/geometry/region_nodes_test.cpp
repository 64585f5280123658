// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/region_nodes.hpp"

#include <gmock/gmock.h>

#include <cmath>

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
  const auto far = nodes_in_region(model, BallRegion{Vec3(500, 0, -1), 40.0}, {});
  ASSERT_FALSE(far);
  EXPECT_EQ(far.error().code, ErrorCode::kEmptySet);
  EXPECT_EQ(far.error().message, "no node lies in the ball of 40 mm about (500, 0, -1) mm");
  model.tumour = {};
  const auto none = nodes_in_region(model, TumourRegion{40.0}, distances_from_tumour(model));
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().message, "the model has no tumour");
}

}  // namespace
}  // namespace brainshift::geometry
