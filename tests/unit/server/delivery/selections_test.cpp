// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/delivery/selections.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "common/core/random.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::server {
namespace {

std::shared_ptr<const BrainModel> toy_model() {
  return std::make_shared<const BrainModel>(test_support::toy_patient(12));  // nodes 5 mm apart
}

SelectionPtr resolved(Selections& selections, const FieldChoice& choice) {
  return value_or_fail(selections.resolve(choice));
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
  EXPECT_EQ(refusal_of(selections.resolve({.region = BallRegion{Vec3(500, 0, -1), 40.0}}),
                       ErrorCode::kEmptySet),
            "choice: no node lies in the ball of 40 mm about (500, 0, -1) mm");

  BrainModel healthy = test_support::toy_patient(3);
  healthy.tumour = {};
  Selections without(std::make_shared<const BrainModel>(std::move(healthy)));
  EXPECT_EQ(sentence_of(without.resolve({.region = TumourRegion{40.0}})),
            "choice: the model has no tumour");
}

TEST(Selections, ABadLengthIsRefused) {
  Selections selections(toy_model());
  refusal_of(selections.resolve({.spacing_mm = -1.0}), ErrorCode::kInvalidArgument);
}

// ---------- nodes apart ----------

struct Cloud {
  Points nodes;
  std::vector<NodeIndex> candidates;  // two thirds of them
  std::vector<bool> on_boundary;      // a third
};

// In a box of 60 mm about the origin: negative coordinates too.
Cloud random_cloud(unsigned seed, int count) {
  Random random(seed);
  Cloud cloud;
  cloud.nodes.resize(3, count);
  for (NodeIndex i = 0; i < count; ++i) {
    for (int axis = 0; axis < 3; ++axis) cloud.nodes(axis, i) = 60.0 * random.uniform() - 30.0;
    if (random.uniform() < 2.0 / 3.0) cloud.candidates.push_back(i);
    cloud.on_boundary.push_back(random.uniform() < 1.0 / 3.0);
  }
  return cloud;
}

double nearest(const Cloud& cloud, NodeIndex node, const std::vector<NodeIndex>& chosen,
               bool boundary_only) {
  double distance = std::numeric_limits<double>::infinity();
  for (const NodeIndex other : chosen) {
    if (other == node) continue;
    if (boundary_only && !cloud.on_boundary[static_cast<std::size_t>(other)]) continue;
    distance = std::min(distance, (cloud.nodes.col(node) - cloud.nodes.col(other)).norm());
  }
  return distance;
}

TEST(ThinNodes, ChosenAreApartAndEveryCandidateHasOneNear) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Cloud cloud = random_cloud(seed, 900);
    for (const double spacing_mm : {2.0, 7.5, 25.0}) {
      const auto chosen = thin_nodes(cloud.nodes, cloud.candidates, cloud.on_boundary, spacing_mm);
      ASSERT_FALSE(chosen.empty());
      EXPECT_TRUE(std::is_sorted(chosen.begin(), chosen.end()));
      EXPECT_TRUE(std::includes(cloud.candidates.begin(), cloud.candidates.end(), chosen.begin(),
                                chosen.end()));
      for (const NodeIndex node : chosen) {
        EXPECT_GE(nearest(cloud, node, chosen, false), spacing_mm);
      }
      for (const NodeIndex node : cloud.candidates) {
        if (std::binary_search(chosen.begin(), chosen.end(), node)) continue;
        EXPECT_LT(nearest(cloud, node, chosen, false), spacing_mm);
        if (!cloud.on_boundary[static_cast<std::size_t>(node)]) continue;
        EXPECT_LT(nearest(cloud, node, chosen, true), spacing_mm) << "a boundary node";
      }
    }
  }
}

TEST(ThinNodes, ASpacingBelowTheMeshKeepsAllAndOneBeyondItKeepsOne) {
  const Cloud cloud = random_cloud(4, 200);
  EXPECT_EQ(thin_nodes(cloud.nodes, cloud.candidates, cloud.on_boundary, 1e-6), cloud.candidates);
  EXPECT_EQ(thin_nodes(cloud.nodes, cloud.candidates, cloud.on_boundary, 1000.0).size(), 1u);
}

}  // namespace
}  // namespace brainshift::server
