// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/slave_compliance.hpp"

#include <gtest/gtest.h>

#include "tests/unit/inversion/skull_fixture.hpp"

namespace brainshift::inversion {
namespace {

struct Pressing {
  explicit Pressing(std::uint64_t seed) {
    Random random(seed);
    list_of(random_set(random, 0.4));
    forces.resize(static_cast<Eigen::Index>(slaves.size()));
    for (double& force : forces) force = 5.0 * random.normal();
  }
  void list_of(const contact::ActiveSet& set) {
    for (std::size_t i = 0; i < set.size(); ++i) {
      if (set[i]) slaves.push_back(static_cast<int>(i));
    }
  }
  std::vector<int> slaves;
  VecX forces;
};

TEST(SlaveCompliance, IsOffByLessThanItSays) {
  const CondensedOperators brain = skull_operators(0.5);
  ThreadTeam team(2);
  SlaveCompliance compliance(brain, team);
  double worst = 0.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Pressing pressing(seed);
    const VecX exact = brain.compliance(Eigen::all, pressing.slaves) * pressing.forces;
    VecX depth = VecX::Zero(kSlaves);
    compliance.subtract(pressing.slaves, pressing.forces, depth);
    const double off = (depth + exact).cwiseAbs().maxCoeff();
    const double bound = compliance.error_mm(pressing.slaves, pressing.forces);
    EXPECT_LT(off, bound);
    EXPECT_LT(bound, 1e-2) << "the bound is of no use";
    worst = std::max(worst, off);
    for (const int slave : {0, 17, kSlaves - 1}) {
      EXPECT_NEAR(compliance.at(slave, pressing.slaves, pressing.forces), exact[slave], 1e-12);
    }
  }
  EXPECT_GT(worst, 1e-7) << "the test shows nothing";
}

TEST(SlaveCompliance, DoesNotDependOnTheNumberOfThreads) {
  const CondensedOperators brain = skull_operators(0.5);
  const Pressing pressing(3);
  std::vector<VecX> found;
  for (const int threads : {1, 2, 3}) {
    ThreadTeam team(threads);
    SlaveCompliance compliance(brain, team);
    found.push_back(brain.initial_penetration_mm);
    compliance.subtract(pressing.slaves, pressing.forces, found.back());
    EXPECT_EQ(found.back(), found.front()) << threads;
  }
  EXPECT_NE(found.front(), brain.initial_penetration_mm);
}

TEST(SlaveCompliance, WithoutForcesNothingChanges) {
  const CondensedOperators brain = skull_operators(0.5);
  ThreadTeam team(2);
  SlaveCompliance compliance(brain, team);
  VecX depth = brain.initial_penetration_mm;
  compliance.subtract({}, VecX(0), depth);
  EXPECT_EQ(depth, brain.initial_penetration_mm);
  EXPECT_EQ(compliance.error_mm({}, VecX(0)), 0.0);
}

}  // namespace
}  // namespace brainshift::inversion
