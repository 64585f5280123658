// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "common/core/random.hpp"
#include "common/inversion/skull/contact_system.hpp"
#include "common/inversion/skull/principal_factor.hpp"
#include "tests/support/dense.hpp"
#include "tests/support/results.hpp"
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
  const MatrixXd expected = test_support::solve_positive(d, x);
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

TEST(PrincipalFactor, KeepsItsBaseWhateverMembersHaveChangedBefore) {
  constexpr int kAll = 300, kBase = 150, kEach = 10;
  CondensedOperators brain;
  brain.compliance.resize(kAll, kAll);
  for (int i = 0; i < kAll; ++i) {
    for (int j = 0; j < kAll; ++j) brain.compliance(i, j) = 2.0 * std::exp(-std::abs(i - j) / 3.0);
  }
  ThreadTeam team(2);
  PrincipalFactor factor(brain.compliance.data(), kAll, 1.0 / kBeta, team);
  contact::ActiveSet base(kAll);
  std::fill(base.begin(), base.begin() + kBase, char{1});
  ASSERT_TRUE(factor.take(base));
  for (int first = 0; first < kBase; first += kEach) {
    contact::ActiveSet set = base;
    for (int i = first; i < first + kEach; ++i) {
      set[static_cast<std::size_t>(i)] = 0;
      set[static_cast<std::size_t>(kBase + i)] = 1;
    }
    ASSERT_TRUE(factor.take(set));
    EXPECT_EQ(factor.work_rows(), kBase + 2 * kEach);
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

// The set's own compliance, factorised on its own.
struct Reference {
  Reference(const CondensedOperators& brain, const contact::ActiveSet& set) {
    list_active(set, active);
    own = brain.compliance(active, active);
    own.diagonal().array() += 1.0 / kBeta;
  }
  MatrixXd solve(const MatrixXd& b) const { return test_support::solve_positive(own, b); }

  std::vector<int> active;
  MatrixXd own;
};

// All that a system answers for one set.
void expect_answers(const CondensedOperators& brain, ContactSystem& system,
                    const contact::ActiveSet& set, ModeWindow window) {
  const Reference reference(brain, set);
  ASSERT_EQ(system.active(), reference.active);
  ASSERT_EQ(system.set(), set);
  const std::vector<int>& active = reference.active;
  const auto k = static_cast<Eigen::Index>(active.size());
  const MatrixXd modes = brain.slave_modes.middleCols(window.first, window.count);
  const VecX z = skull_loads(11, 1.0).head(window.count);

  const VecX free = brain.initial_penetration_mm - modes * z;
  const VecX forces = reference.solve(VecX(free(active)));
  const VecX depth = free - brain.compliance(Eigen::all, active) * forces;
  VecX found_forces(k), found_depth(kSlaves);
  system.solve(z, free, found_forces, found_depth);
  EXPECT_LT((found_forces - forces).norm(), 1e-10 * (1.0 + forces.norm()));
  EXPECT_LT((found_depth - depth).norm(), 1e-10 * (1.0 + depth.norm()));

  MatrixXd loads(k, window.count + 1);
  loads << modes(active, Eigen::all), brain.initial_penetration_mm(active);
  const MatrixXd response = reference.solve(loads);
  MatrixXd found_response(k, window.count + 1);
  system.respond(found_response);
  EXPECT_LT((found_response - response).norm(), 1e-10 * (1.0 + response.norm()));

  Random random(12);
  VecX felt(k);
  for (double& value : felt) value = random.normal();
  VecX adjoint = VecX::Ones(window.count);
  const VecX expected = adjoint + response.leftCols(window.count).transpose() * felt;
  system.add_adjoint(felt, adjoint);
  EXPECT_LT((adjoint - expected).norm(), 1e-10 * (1.0 + expected.norm()));

  MatrixXd any(k, 3);
  for (double& value : any.reshaped()) value = random.normal();
  const MatrixXd solved = reference.solve(any);
  system.solve(any);
  EXPECT_LT((any - solved).norm(), 1e-10 * (1.0 + solved.norm()));
}

TEST(ContactSystem, AnswersForFewSlavesAsForMost) {
  const CondensedOperators brain = skull_operators(0.5);
  ThreadTeam team(2);
  for (const ModeWindow window : {kWindow, ModeWindow{2, 7}}) {
    ContactSystem system(brain, window, kBeta, team);
    Random random(3);
    int most = 0, fewer = 0;
    for (const double share : {0.1, 0.5, 0.7, 0.9, 0.95, 0.3, 0.8, 1.1, 0.62, 0.58}) {
      contact::ActiveSet set = random_set(random, share);
      for (int step = 0; step < 5; ++step) {
        ASSERT_TRUE(system.take(set));
        expect_answers(brain, system, set, window);
        (system.size() > ContactSystem::kMax * kSlaves ? most : fewer) += 1;
        for (int i = 0; i <= step; ++i) {
          char& one = set[static_cast<std::size_t>(random.uniform() * kSlaves)];
          one = one ? 0 : 1;
        }
      }
    }
    EXPECT_GT(most, 15) << "the test shows nothing";
    EXPECT_GT(fewer, 15) << "the test shows nothing";
  }
}

TEST(ContactSystem, ServesTheEmptySetAndAllSlaves) {
  const CondensedOperators brain = skull_operators(0.5);
  ThreadTeam team(2);
  ContactSystem system(brain, kWindow, kBeta, team);
  const contact::ActiveSet none(kSlaves), all(kSlaves, 1);
  for (const contact::ActiveSet& set : {none, all, none}) {
    ASSERT_TRUE(system.take(set));
    if (system.size() > 0) {
      expect_answers(brain, system, set, kWindow);
      continue;
    }
    const VecX z = skull_loads(4, 1.0), free = brain.initial_penetration_mm - brain.slave_modes * z;
    VecX forces(0), depth(kSlaves);
    system.solve(z, free, forces, depth);
    EXPECT_EQ(depth, free);
  }
}

TEST(ContactSystem, AnIndefiniteComplianceIsRejectedAndLeavesNoSet) {
  for (const double share : {0.3, 0.9}) {
    CondensedOperators brain = skull_operators(0.5);
    brain.compliance(7, 7) = -1.0;
    ThreadTeam team(2);
    ContactSystem system(brain, kWindow, kBeta, team);
    contact::ActiveSet set(kSlaves);
    for (int i = 0; i < share * kSlaves; ++i) set[static_cast<std::size_t>(i)] = 1;
    refusal_of(system.take(set), ErrorCode::kSingularMatrix);
    EXPECT_EQ(system.size(), 0);
    std::fill(set.begin(), set.begin() + 30, char{0});
    if (share > ContactSystem::kMax) continue;
    ASSERT_TRUE(system.take(set));
  }
}

}  // namespace
}  // namespace brainshift::inversion
