// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/principal_factor.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "common/core/random.hpp"
#include "tests/unit/inversion/skull_fixture.hpp"

namespace brainshift::inversion {
namespace {

using Eigen::MatrixXd;

constexpr int kColumns = 3;

MatrixXd right_hand_sides(int rows) {
  Random random(9);
  MatrixXd b(rows, kColumns);
  for (double& value : b.reshaped()) value = random.normal();
  return b;
}

// Against a factor of the set itself.
void expect_solves(const CondensedOperators& brain, const PrincipalFactor& factor,
                   const contact::ActiveSet& set) {
  std::vector<int> active;
  list_active(set, active);
  ASSERT_EQ(factor.active(), active);
  ASSERT_EQ(factor.set(), set);
  const int k = static_cast<int>(active.size());
  MatrixXd d = brain.compliance(active, active);
  d.diagonal().array() += 1.0 / kBeta;
  MatrixXd x = right_hand_sides(k);
  const MatrixXd expected = d.llt().solve(x);
  MatrixXd work(factor.work_rows(), kColumns);
  factor.solve(x, work);
  EXPECT_LT((x - expected).norm(), 1e-11 * (1.0 + expected.norm()));
}

TEST(PrincipalFactor, SolvesForSetsThatFollowEachOther) {
  const CondensedOperators brain = skull_operators(0.5);
  ThreadTeam team(2);
  PrincipalFactor factor(brain.compliance.data(), kSlaves, 1.0 / kBeta, team);
  Random random(3);
  contact::ActiveSet set = random_set(random, 0.6);
  int updates = 0;
  for (int step = 0; step < 200; ++step) {
    ASSERT_TRUE(factor.take(set));
    expect_solves(brain, factor, set);
    updates += factor.work_rows() > factor.size() ? 1 : 0;  // not a base of its own
    const int changes = step % 10 == 9 ? 40 : 1 + step % 6;
    for (int i = 0; i < changes; ++i) {
      char& one = set[static_cast<std::size_t>(random.uniform() * kSlaves)];
      one = one ? 0 : 1;
    }
  }
  EXPECT_GT(updates, 100) << "the test shows nothing";
  EXPECT_LT(updates, 199) << "the test shows nothing";
}

TEST(PrincipalFactor, SolvesWhereSlavesOnlyJoinOrOnlyLeave) {
  const CondensedOperators brain = skull_operators(0.5);
  for (const bool join : {true, false}) {
    ThreadTeam team(2);
    PrincipalFactor factor(brain.compliance.data(), kSlaves, 1.0 / kBeta, team);
    contact::ActiveSet set(kSlaves);
    for (int i = 0; i < kSlaves; ++i) set[static_cast<std::size_t>(i)] = i % 3 == 0 ? 1 : 0;
    ASSERT_TRUE(factor.take(set));
    for (int i = 0; i < 8; ++i) set[static_cast<std::size_t>(join ? 3 * i + 1 : 3 * i)] = join;
    ASSERT_TRUE(factor.take(set));
    EXPECT_EQ(factor.work_rows(), kSlaves / 3 + 8);
    expect_solves(brain, factor, set);
  }
}

TEST(PrincipalFactor, ServesTheEmptySetAndComesBackFromIt) {
  const CondensedOperators brain = skull_operators(0.5);
  ThreadTeam team(2);
  PrincipalFactor factor(brain.compliance.data(), kSlaves, 1.0 / kBeta, team);
  Random random(4);
  const contact::ActiveSet none(kSlaves), some = random_set(random, 0.05), all(kSlaves, 1);
  for (const contact::ActiveSet& set : {none, some, none, all, none, some}) {
    ASSERT_TRUE(factor.take(set));
    if (factor.size() > 0) expect_solves(brain, factor, set);
  }
}

TEST(PrincipalFactor, AnIndefiniteMatrixIsRejectedAndLeavesNoSet) {
  CondensedOperators brain = skull_operators(0.5);
  brain.compliance(7, 7) = -1.0;
  ThreadTeam team(2);
  PrincipalFactor factor(brain.compliance.data(), kSlaves, 1.0 / kBeta, team);
  contact::ActiveSet set(kSlaves);
  for (int i = 20; i < 60; ++i) set[static_cast<std::size_t>(i)] = 1;
  ASSERT_TRUE(factor.take(set));
  contact::ActiveSet with = set;
  with[7] = 1;  // joins by an update
  EXPECT_FALSE(factor.take(with));
  EXPECT_EQ(factor.size(), 0);
  ASSERT_TRUE(factor.take(set));
  expect_solves(brain, factor, set);
}

}  // namespace
}  // namespace brainshift::inversion
