// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/delivery/thin_nodes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "common/core/random.hpp"

namespace brainshift::server {
namespace {

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
