// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/set_search.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

namespace brainshift::contact {
namespace {

const VecX kUnit = VecX::Ones(3);

TEST(SetSearch, EndsWhenNothingIsViolated) {
  SetSearch search(3, 10);
  search.begin();
  EXPECT_EQ(search.next(VecX::Zero(3), VecX::Constant(3, -0.5), kUnit), SetSearch::Step::kSolved);
  EXPECT_EQ(search.iteration(), 1);
}

TEST(SetSearch, PenetratingSlavesJoinAndPullingOnesLeave) {
  SetSearch search(3, 10);
  search.begin();
  EXPECT_EQ(search.next(VecX::Zero(3), Vec3(0.5, -0.5, 0.2), kUnit), SetSearch::Step::kContinue);
  EXPECT_EQ(search.current(), (ActiveSet{1, 0, 1}));
  EXPECT_EQ(search.next(Vec3(0.4, 0, -0.3), Vec3(0, -0.1, 0), kUnit), SetSearch::Step::kContinue);
  EXPECT_EQ(search.current(), (ActiveSet{1, 0, 0}));
}

TEST(SetSearch, ViolationsWithinTheToleranceDoNotCount) {
  SetSearch search(3, 10, 1e-3);
  search.begin();
  EXPECT_EQ(search.next(VecX::Zero(3), VecX::Constant(3, 0.9e-3), kUnit), SetSearch::Step::kSolved);
  search.begin();
  EXPECT_EQ(search.next(VecX::Zero(3), VecX::Constant(3, 1.1e-3), kUnit),
            SetSearch::Step::kContinue);
}

// Two slaves that chase each other for ever when both change at once. Every set has a violation;
// that of {0}, by slave 1, is the least.
struct Chase {
  VecX forces = VecX::Zero(2), penetration = VecX::Zero(2);
  explicit Chase(const ActiveSet& set, double least) {
    if (!set[0] && !set[1]) penetration << 1.0, 1.0;
    if (set[0] && set[1]) forces << -1.0, -1.0;
    if (set[0] && !set[1]) penetration << 0.0, least;
    if (!set[0] && set[1]) penetration << 0.5, 0.0;
  }
};

SetSearch::Step run_chase(SetSearch& search, double least) {
  search.begin();
  SetSearch::Step step = SetSearch::Step::kContinue;
  for (int calls = 0; calls < 40; ++calls) {
    const Chase now(search.current(), least);
    step = search.next(now.forces, now.penetration, VecX::Ones(2));
    if (step == SetSearch::Step::kCycling) search.pivot(now.forces, now.penetration, VecX::Ones(2));
    if (step == SetSearch::Step::kExhausted) break;
  }
  return step;
}

TEST(SetSearch, ACycleIsReportedAndTheBestSetKept) {
  SetSearch search(2, 12);
  EXPECT_EQ(run_chase(search, 0.1), SetSearch::Step::kExhausted);
  EXPECT_EQ(search.iteration(), 12);
  EXPECT_TRUE(search.cycled());
  EXPECT_EQ(search.best(), (ActiveSet{1, 0}));
  EXPECT_EQ(search.violation_mm(), 0.1);
}

TEST(SetSearch, ACycleWhoseBestSetHoldsEndsEarly) {
  SetSearch search(2, 30);
  EXPECT_EQ(run_chase(search, 0.9 * kHolds_mm), SetSearch::Step::kExhausted);
  EXPECT_LT(search.iteration(), 15);
  EXPECT_EQ(search.best(), (ActiveSet{1, 0}));
}

TEST(SetSearch, FollowReportsWhetherTheSetChanged) {
  SetSearch search(2, 30);
  search.begin();
  const Chase now(search.current(), 0.1);
  EXPECT_TRUE(search.follow(now.forces, now.penetration));
  EXPECT_EQ(search.current(), (ActiveSet{1, 1}));
  EXPECT_FALSE(search.follow(VecX::Zero(2), VecX::Zero(2)));
}

// A linear complementarity problem with a symmetric positive definite matrix has one solution.
// The search must find it.
TEST(SetSearch, SolvesContactWithFixedLoads) {
  std::srand(5);
  const Eigen::MatrixXd root = Eigen::MatrixXd::Random(40, 40);
  const Eigen::MatrixXd compliance =
      root * root.transpose() + 0.5 * Eigen::MatrixXd::Identity(40, 40);
  const VecX gap = VecX::Random(40);  // penetration without forces
  SetSearch search(40, 60, 0.0);
  search.begin();
  SetSearch::Step step = SetSearch::Step::kContinue;
  VecX forces, penetration;
  while (step == SetSearch::Step::kContinue) {
    std::vector<int> active;
    for (int i = 0; i < 40; ++i) {
      if (search.current()[static_cast<std::size_t>(i)]) active.push_back(i);
    }
    forces = VecX::Zero(40);
    const Eigen::MatrixXd block = compliance(active, active);
    const VecX rhs = gap(active);
    forces(active) = VecX(block.llt().solve(rhs));
    penetration = gap - compliance * forces;
    penetration(active).setZero();
    step = search.next(forces, penetration, compliance.diagonal());
  }
  ASSERT_EQ(step, SetSearch::Step::kSolved);
  EXPECT_GT((forces.array() > 0.0).count(), 3);
  EXPECT_GE(forces.minCoeff(), 0.0);
  EXPECT_LE(penetration.maxCoeff(), 0.0);
}

TEST(SetSearch, BeginsWhereTheLastOneEndedUntilItIsForgotten) {
  SetSearch search(3, 10);
  search.begin();
  search.next(VecX::Zero(3), Vec3(1, 1, -1), kUnit);
  search.begin();
  EXPECT_EQ(search.current(), (ActiveSet{1, 1, 0}));
  search.forget();
  EXPECT_EQ(search.current(), (ActiveSet{0, 0, 0}));
}

}  // namespace
}  // namespace brainshift::contact
