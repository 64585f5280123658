// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/delivery/selections.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/toy_patient.hpp"

namespace brainshift::server {
namespace {

std::shared_ptr<const BrainModel> toy_model() {
  return std::make_shared<const BrainModel>(test_support::toy_patient(12));  // nodes 5 mm apart
}

SelectionPtr resolved(Selections& selections, const FieldChoice& choice) {
  const auto selection = selections.resolve(choice);
  EXPECT_TRUE(selection) << selection.error().message;
  return selection ? *selection : nullptr;
}

TEST(Selections, EverythingIsNoSelection) {
  Selections selections(toy_model());
  EXPECT_EQ(resolved(selections, {}), nullptr);
}

TEST(Selections, WithoutRegionAndSpacingEveryNodeIsChosen) {
  const auto model = toy_model();
  Selections selections(model);
  const SelectionPtr chosen = resolved(selections, {.tolerance_mm = 0.1});
  EXPECT_EQ(chosen->mesh_nodes, model->mesh.nodes.cols());
  EXPECT_TRUE(chosen->every_node());
}

TEST(Selections, ABallHoldsTheNodesInItAndNoOther) {
  const auto model = toy_model();
  Selections selections(model);
  const Vec3 centre(20, 30, 41);
  const SelectionPtr chosen = resolved(selections, {.region = BallRegion{centre, 15.0}});
  EXPECT_GT(chosen->nodes.size(), 10u);
  EXPECT_FALSE(chosen->every_node());
  for (NodeIndex node = 0; node < model->mesh.nodes.cols(); ++node) {
    EXPECT_EQ(std::binary_search(chosen->nodes.begin(), chosen->nodes.end(), node),
              (model->mesh.nodes.col(node) - centre).norm() <= 15.0);
  }
}

// A ball of 10 mm at (30, 30, 40), up to the flatness of its triangles.
TEST(Selections, TheTumourHoldsItsInsideAndItsMargin) {
  constexpr double kFlat_mm = 0.8;
  const auto model = toy_model();
  Selections selections(model);
  for (const double margin_mm : {0.0, 4.0, 12.0}) {
    const SelectionPtr chosen = resolved(selections, {.region = TumourRegion{margin_mm}});
    int inside = 0;
    for (NodeIndex node = 0; node < model->mesh.nodes.cols(); ++node) {
      const double depth = (model->mesh.nodes.col(node) - Vec3(30, 30, 40)).norm() - 10.0;
      const bool taken = std::binary_search(chosen->nodes.begin(), chosen->nodes.end(), node);
      if (depth < margin_mm - kFlat_mm) {
        EXPECT_TRUE(taken) << depth;
      }
      if (depth > margin_mm + kFlat_mm) {
        EXPECT_FALSE(taken) << depth;
      }
      inside += depth < margin_mm - kFlat_mm;
    }
    EXPECT_GE(inside, 20);
  }
}

TEST(Selections, ARegionIsThinnedWithinItself) {
  Selections selections(toy_model());
  const SelectionPtr region = resolved(selections, {.region = TumourRegion{10.0}});
  const SelectionPtr thinned =
      resolved(selections, {.region = TumourRegion{10.0}, .spacing_mm = 8.0});
  EXPECT_LT(thinned->nodes.size(), region->nodes.size() / 2);
  EXPECT_TRUE(std::includes(region->nodes.begin(), region->nodes.end(), thinned->nodes.begin(),
                            thinned->nodes.end()));
}

TEST(Selections, EqualChoicesAreSharedForAsLongAsSomebodyHasThem) {
  Selections selections(toy_model());
  const FieldChoice choice{.region = TumourRegion{10.0}, .tolerance_mm = 0.1};
  SelectionPtr first = resolved(selections, choice);
  EXPECT_EQ(resolved(selections, choice), first);
  const FieldChoice other{.region = TumourRegion{10.0}, .tolerance_mm = 0.2};
  EXPECT_NE(resolved(selections, other), first);
  const std::weak_ptr<const Selection> watched = first;
  first.reset();
  EXPECT_TRUE(watched.expired());
  EXPECT_TRUE(resolved(selections, choice));
}

TEST(Selections, ARegionWithoutNodesIsNamed) {
  Selections selections(toy_model());
  const auto far = selections.resolve({.region = BallRegion{Vec3(500, 0, -1), 40.0}});
  ASSERT_FALSE(far);
  EXPECT_EQ(far.error().code, ErrorCode::kEmptySet);
  EXPECT_EQ(far.error().message, "choice: no node lies in the ball of 40 mm about (500, 0, -1) mm");

  BrainModel healthy = test_support::toy_patient(3);
  healthy.tumour = {};
  Selections without(std::make_shared<const BrainModel>(std::move(healthy)));
  const auto tumour = without.resolve({.region = TumourRegion{40.0}});
  ASSERT_FALSE(tumour);
  EXPECT_EQ(tumour.error().message, "choice: the model has no tumour");
}

TEST(Selections, ABadLengthIsRefused) {
  Selections selections(toy_model());
  const auto refused = selections.resolve({.spacing_mm = -1.0});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace brainshift::server
