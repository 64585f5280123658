// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/tumour_motion.hpp"

#include <gtest/gtest.h>

#include "tests/support/toy_patient.hpp"

namespace brainshift::geometry {
namespace {

TEST(TumourMotion, NodesAreTheOnesInsideTheTumour) {
  const BrainModel model = test_support::toy_patient(12);
  const auto nodes = tumour_nodes(model);
  EXPECT_GT(nodes.size(), 20u);
  for (const NodeIndex node : nodes) {
    EXPECT_LE((model.mesh.nodes.col(node) - Vec3(30, 30, 40)).norm(), 10.001);
  }
}

TEST(TumourMotion, IsThatOfItsNodesAmongThePart) {
  Update update;
  update.estimate.displacement.resize(3, 3);
  update.estimate.displacement << 3, 0, 9, 4, 0, 9, 0, 1, 9;
  EXPECT_DOUBLE_EQ(tumour_motion(update, {0, 1})->mm, 3.0);  // 5 and 1 mm
  EXPECT_FALSE(tumour_motion(update, {0, 1})->sd_mm);
  update.estimate.sd_mm = Vec3(0.1, 0.4, 7.0);
  EXPECT_DOUBLE_EQ(*tumour_motion(update, {0, 1})->sd_mm, 0.25);
  update.part = FieldPart{100, {7, 20, 30}, 0};
  EXPECT_DOUBLE_EQ(tumour_motion(update, {20, 50})->mm, 1.0);
  EXPECT_FALSE(tumour_motion(update, {0, 1, 2}));
}

}  // namespace
}  // namespace brainshift::geometry
