// SPDX-License-Identifier: GPL-3.0-or-later
// Slits with a fixed sheet: two blocks of 30 mm on either side of the plane x = 30 mm.
#include <gtest/gtest.h>

#include "common/contact/forward_model.hpp"
#include "tests/support/results.hpp"
#include "tests/support/slit_block.hpp"

namespace brainshift::contact {
namespace {

using test_support::kSlitPoisson;
using test_support::kSlitShear;
using test_support::sides_of;

BrainModel blocks(double gap_mm) { return test_support::slit_block({4, 3, 3}, gap_mm); }
ForwardModel on_rollers(const BrainModel& model) {
  return value_or_fail(test_support::on_rollers(model));
}
Points equilibrium(const ForwardModel& forward, const Points& load) {
  return value_or_fail(test_support::equilibrium(forward, load));
}

// A sheet that is too thick by 0.3 mm on either side presses each block into uniform uniaxial
// stress.
TEST(Septa, ASheetThatPressesGivesUniformStress) {
  const BrainModel model = blocks(-0.3);
  const ForwardModel forward = on_rollers(model);
  const Points u = equilibrium(forward, Points::Zero(3, model.mesh.num_nodes()));
  const std::vector<int> sides = sides_of(model.mesh);
  constexpr double kStrain = 0.3 / 30.0;
  for (int n = 0; n < model.mesh.num_nodes(); ++n) {
    const Vec3 x = model.mesh.nodes.col(n);
    const double along = sides[static_cast<std::size_t>(n)] < 0 ? -x[0] : 60.0 - x[0];
    const Vec3 expected = kStrain * Vec3(along, kSlitPoisson * x[1], kSlitPoisson * x[2]);
    EXPECT_LT((u.col(n) - expected).norm(), 1e-5 * 0.3) << x.transpose();
  }
  EXPECT_LT(forward.contact().penetration(u).maxCoeff(), 1e-5 * 0.3);
}

TEST(Septa, BlocksThatArePulledApartCarryNothingAcross) {
  const BrainModel model = blocks(0.3);
  const ForwardModel forward = on_rollers(model);
  // Both are drawn away from the sheet by their own weight.
  Points load = Points::Zero(3, model.mesh.num_nodes());
  const std::vector<int> sides = sides_of(model.mesh);
  const VecX volumes = fem::nodal_volumes(model.mesh);
  for (int n = 0; n < model.mesh.num_nodes(); ++n)
    load(0, n) = sides[static_cast<std::size_t>(n)] * 1e-5 * volumes[n];
  const Points u = equilibrium(forward, load);
  EXPECT_EQ(count(forward.contact().penetrating(u)), 0);
  // Each is a column of its own: its free end moves by f L^2 / 2 E, in the mean over its few nodes.
  const double end = 1e-5 * 30.0 * 30.0 / 2.0 / (2.0 * kSlitShear * (1.0 + kSlitPoisson));
  double mean = 0.0;
  for (const NodeIndex node : model.septa.slaves) {
    const double out = sides[static_cast<std::size_t>(node)] * u(0, node);
    EXPECT_GT(out, 0.0);
    mean += out / static_cast<double>(model.septa.slaves.size());
  }
  EXPECT_NEAR(mean, end, 0.1 * end);
}

TEST(Septa, TissueMovesFreelyWithinTheGapAndStopsThere) {
  const BrainModel model = blocks(0.5);
  const ForwardModel forward = on_rollers(model);
  Points load = Points::Zero(3, model.mesh.num_nodes());
  const std::vector<int> sides = sides_of(model.mesh);
  const VecX volumes = fem::nodal_volumes(model.mesh);
  for (int n = 0; n < model.mesh.num_nodes(); ++n)
    if (sides[static_cast<std::size_t>(n)] < 0) load(0, n) = 5e-5 * volumes[n];
  const Points u = equilibrium(forward, load);
  EXPECT_GT(count(forward.contact().penetrating(u)), 0);
  double most = 0.0;
  for (const NodeIndex node : model.septa.slaves) {
    most = std::max(most, u(0, node));
    if (sides[static_cast<std::size_t>(node)] > 0) {
      EXPECT_LT(u.col(node).norm(), 1e-12);
    }
  }
  EXPECT_NEAR(most, 0.5, 1e-3);
}

TEST(Septa, UnderTheFixedBoundaryNoSideMovesAlongTheNormal) {
  BrainModel model = blocks(0.5);
  for (int n = 0; n < model.mesh.num_nodes(); ++n)
    if (model.mesh.nodes(2, n) == 0.0 && model.mesh.nodes(0, n) != 30.0) model.fixed.push_back(n);
  CaseConfig config;
  const auto forward = value_or_fail(ForwardModel::build(model, config, Boundary::kFixed));
  std::srand(5);
  Points u;
  ASSERT_TRUE(forward.solve(Points::Random(3, model.mesh.num_nodes()), u).has_value());
  double slides = 0.0;
  for (std::size_t i = 0; i < model.septa.slaves.size(); ++i) {
    const auto moved = u.col(model.septa.slaves[i]);
    EXPECT_NEAR(moved.dot(model.septa.normals.col(static_cast<Eigen::Index>(i))), 0.0, 1e-9);
    slides = std::max(slides, moved.norm());
  }
  EXPECT_GT(slides, 1e-3);
}

}  // namespace
}  // namespace brainshift::contact
