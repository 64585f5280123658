// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/truth.hpp"

#include <gtest/gtest.h>

#include <set>

#include "client/tools/twin/load.hpp"
#include "common/fem/body_loads.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {
namespace {

class TruthSolverTest : public testing::Test {
 protected:
  Points load(double fluid_level_mm, double strain) const {
    const Vec3 g = model.gravity_direction;
    const Points gravity = fem::buoyancy_load(model.mesh, config.material, g,
                                              model.fluid_plane_depth_mm + fluid_level_mm, g);
    return gravity + swelling_load(model.mesh, config.material, Vec3(30, 30, 40), {strain, 45.0});
  }
  BrainModel model = test_support::toy_patient(6);
  CaseConfig config = test_support::toy_config();
  Result<contact::ForwardModel> forward =
      contact::ForwardModel::build(model, config, Boundary::kContact);
};

// From no active slave to all 88 of them. The reference begins every search from the empty set and
// factorises K_p anew for every set.
TEST_F(TruthSolverTest, EqualsASearchFromTheEmptySetForEveryLoadOfASeries) {
  ASSERT_TRUE(forward);
  TruthSolver solver(*forward);
  std::set<int> active;
  for (const double strain : {0.0, 0.1, 0.13, 0.13, 0.11, -0.3, 0.09, 0.16, 0.6}) {
    SCOPED_TRACE(strain);
    const Points b = load(20.0, strain);
    const auto truth = solver.solve(b);
    ASSERT_TRUE(truth) << truth.error().message;
    const auto reference = forward->solve_with_contact(b);
    ASSERT_TRUE(reference);
    ASSERT_TRUE(reference->converged);
    EXPECT_EQ(truth->active, contact::count(reference->active));
    EXPECT_LT((truth->displacement - reference->displacement).norm(),
              1e-9 * reference->displacement.norm());
    EXPECT_DOUBLE_EQ(truth->max_penetration_mm,
                     forward->contact().penetration(truth->displacement).maxCoeff());
    active.insert(truth->active);
  }
  EXPECT_GE(active.size(), 5u) << "the loads must differ in what touches the skull";
  EXPECT_EQ(active.count(0), 1u);
}

TEST_F(TruthSolverTest, TheSameLoadAgainTakesOneSolve) {
  ASSERT_TRUE(forward);
  TruthSolver solver(*forward);
  const Points b = load(20.0, 0.5);
  const auto first = solver.solve(b);
  ASSERT_TRUE(first);
  ASSERT_GT(first->active, 0);
  EXPECT_GT(first->iterations, 1);
  const auto again = solver.solve(b);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->iterations, 1);
  EXPECT_EQ(again->displacement, first->displacement);
}

}  // namespace
}  // namespace brainshift::client
