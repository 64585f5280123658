// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/retraction.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "client/tools/twin/load.hpp"
#include "client/tools/twin/surgery.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

// The toy patient's opening is a disc of radius 16 mm in the plane z = 60, its normal +z.
class RetractionLoad : public testing::Test {
 protected:
  BrainModel model = test_support::toy_patient(24);
  Retraction straight{3000.0, 10.0, 0.0};
};

// int p (1 - (r/R)^2)^2 dA = p pi R^2 / 3. The nodes sample it 2.5 mm apart.
TEST_F(RetractionLoad, IsThePressureOverTheSpatula) {
  const Points load = retraction_load(model, straight);
  const double force_N = 3000e-6 * std::numbers::pi * 10.0 * 10.0 / 3.0;
  EXPECT_NEAR(load.row(2).sum(), -force_N, 0.03 * force_N);
  EXPECT_EQ(load.topRows<2>().cwiseAbs().maxCoeff(), 0.0);
  Retraction twice = straight;
  twice.pressure_pa *= 2.0;
  EXPECT_LT((retraction_load(model, twice) - 2.0 * load).norm(), 1e-12 * load.norm());
}

TEST_F(RetractionLoad, ActsWithinItsRadiusOnExposedNodesOnly) {
  Retraction moved = straight;
  moved.offset_mm = Vec3(5, 0, 77);  // the part along the normal does not count
  const Points load = retraction_load(model, moved);
  const Vec3 middle = craniotomy_centre(model) + Vec3(5, 0, 0);
  const std::set<NodeIndex> exposed(model.craniotomy.begin(), model.craniotomy.end());
  int loaded = 0;
  for (NodeIndex node = 0; node < model.mesh.num_nodes(); ++node) {
    if (load.col(node).isZero(0.0)) continue;
    ++loaded;
    EXPECT_TRUE(exposed.count(node)) << node;
    EXPECT_LT((model.mesh.nodes.col(node) - middle).norm(), 10.0);
  }
  EXPECT_GT(loaded, 10);
}

TEST_F(RetractionLoad, TurnsTowardsTheSideByItsAngle) {
  const Points pressed = retraction_load(model, straight);
  Retraction aside = straight;
  aside.angle_deg = 30.0;
  aside.aside = Vec3(0, 8, -5);
  const Points load = retraction_load(model, aside);
  EXPECT_LT((load.row(1) + 0.5 * pressed.row(2)).norm(), 1e-12 * load.norm());
  EXPECT_LT((load.row(2) - std::sqrt(0.75) * pressed.row(2)).norm(), 1e-12 * load.norm());
  EXPECT_EQ(load.row(0).norm(), 0.0);
}

TEST(Retraction, ThatTouchesNoExposedNodeIsAnError) {
  Scenario scenario = *find_scenario("retraction");
  scenario.fluid_levels_mm = {-20.0};
  scenario.retraction->offset_mm = Vec3(200, 0, 0);
  const auto surgery =
      play_scenario(test_support::toy_patient(6), test_support::toy_config(), scenario, 1);
  ASSERT_FALSE(surgery);
  EXPECT_EQ(surgery.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(surgery.error().message, testing::HasSubstr("presses on no node of the opening"));
}

TEST(Retraction, PushesTheCortexIntoTheBrain) {
  const BrainModel model = test_support::toy_patient(8);
  Scenario scenario = *find_scenario("retraction");
  scenario.fluid_levels_mm = {-20.0};
  scenario.retraction->angle_deg = 0.0;
  const auto play = [&] {
    const auto surgery = play_scenario(model, test_support::toy_config(), scenario, 1);
    EXPECT_TRUE(surgery) << surgery.error().message;
    return *surgery;
  };
  const SimulatedSurgery pressed = play();
  scenario.retraction.reset();
  const Points change = pressed.truths[0].displacement - play().truths[0].displacement;
  EXPECT_EQ(pressed.truths[0].scalars.at("retraction_pa"), 4000.0);
  EXPECT_LT(change(Eigen::all, model.craniotomy).row(2).mean(), -0.5);
}

}  // namespace
}  // namespace brainshift::client
