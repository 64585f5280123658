// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "common/inversion/skull/contact_at_loads.hpp"
#include "common/inversion/skull/contact_reduction.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/inversion/skull_fixture.hpp"

namespace brainshift::inversion {
namespace {

// Against the search for contact itself, where a step is so small that no slave changes.
TEST(ContactReduction, PredictsForcesAndPenetrationAlsoForModesBeforeTheWindow) {
  const CondensedOperators brain = skull_operators(0.5);
  ThreadTeam team{2};
  constexpr int kBefore = 2;
  const ModeWindow window{kBefore, kModes - kBefore};
  ContactSystem all_modes(brain, kWindow, kBeta, team), some_modes(brain, window, kBeta, team);
  ContactAtLoads contact(brain, kWindow, kBeta, true, all_modes, team);
  ContactReduction model(brain, window, some_modes, team);
  const VecX z = skull_loads(3, 1.0), step = skull_loads(4, 1e-5);
  ASSERT_TRUE(contact.solve(z));
  ASSERT_GT(contact.size(), 10);
  ASSERT_TRUE(model.activate(contact.set()));
  const VecX forces = contact.forces(), penetration = contact.penetration();
  ASSERT_TRUE(contact.solve(z + step));
  ASSERT_EQ(contact.set(), model.set()) << "the step is too long for the test";

  const VecX dg = step.head(kBefore), dz = step.tail(window.count);
  const auto before = value_or_fail(model.response_before());
  const VecX df = -before * dg - model.response().leftCols(window.count) * dz;
  const VecX change = model.penetration_change(dg, dz, df);
  ASSERT_GT(change.norm(), 1e-6);
  EXPECT_LT((contact.forces() - forces - df).norm(), 1e-6 * df.norm());
  EXPECT_LT((contact.penetration() - penetration - change).norm(), 1e-6 * change.norm());
}

// Against a model that knows no set before, for sets of few slaves and of most.
TEST(ContactReduction, FollowsTheSetBeforeToTheResponseOfItsOwn) {
  const CondensedOperators brain = skull_operators(0.5);
  ThreadTeam team{2};
  ContactSystem system(brain, kWindow, kBeta, team), own_system(brain, kWindow, kBeta, team);
  ContactReduction model(brain, kWindow, system, team);
  Random random(6);
  int followed = 0, most = 0;
  for (const double share : {0.3, 0.5, 0.58, 0.62, 0.8, 0.95}) {
    contact::ActiveSet set = random_set(random, share);
    for (int step = 0; step < 12; ++step) {
      ASSERT_TRUE(model.activate(set));
      own_system.forget();
      ContactReduction own(brain, kWindow, own_system, team);
      ASSERT_TRUE(own.activate(set));
      ASSERT_EQ(own.changes(), 0);
      ASSERT_EQ(model.active(), own.active());
      EXPECT_LT((model.response() - own.response()).norm(), 1e-10 * own.response().norm());
      followed += model.changes() > 0 ? 1 : 0;
      most += model.changes() > 0 && model.size() > ContactSystem::kMax * kSlaves ? 1 : 0;
      for (int i = 0; i < 1 + step % 6; ++i) {
        char& one = set[static_cast<std::size_t>(random.uniform() * kSlaves)];
        one = one ? 0 : 1;
      }
    }
  }
  EXPECT_GT(followed, 50) << "the test shows nothing";
  EXPECT_GT(most, 20) << "the test shows nothing";
  ASSERT_TRUE(model.activate(contact::ActiveSet(kSlaves)));
  EXPECT_EQ(model.changes(), 0);
  EXPECT_EQ(model.size(), 0);
}

// Slaves that have changed at z in the linear model, by its definition.
int changes(const CondensedOperators& brain, const ContactReduction& model, const VecX& z) {
  VecX forces(model.size());
  model.forces_at(z, forces);
  VecX depth = brain.initial_penetration_mm - brain.slave_modes * z;
  for (int j = 0; j < model.size(); ++j) {
    depth -= forces[j] * brain.compliance.col(model.active()[static_cast<std::size_t>(j)]);
  }
  int count = static_cast<int>((forces.array() < 0.0).count());
  for (int i = 0; i < kSlaves; ++i) {
    count += !model.set()[static_cast<std::size_t>(i)] && depth[i] > 0.0 ? 1 : 0;
  }
  return count;
}

struct Skull {
  explicit Skull(bool with_contact = true, double gap_mm = 0.5)
      : brain(skull_operators(gap_mm)),
        contact(brain, kWindow, kBeta, with_contact, system, team),
        reach(brain, kWindow, kBeta, with_contact, model, team) {}
  CondensedOperators brain;
  ThreadTeam team{2};
  ContactSystem system{brain, kWindow, kBeta, team};
  ContactReduction model{brain, kWindow, system, team};
  ContactAtLoads contact;
  ContactReach reach;
};

// Without a gap most slaves press.
class ContactReachOf : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Gaps, ContactReachOf, testing::Values(0.5, -12.0));

TEST_P(ContactReachOf, EndsWhereSoManySlavesOfTheLinearModelHaveChanged) {
  Skull skull(true, GetParam());
  auto& [brain, team, system, model, contact, reach] = skull;
  int shortened = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const VecX z = skull_loads(seed, 0.5), step = skull_loads(seed + 20, 2.0);
    ASSERT_TRUE(contact.solve(z));
    ASSERT_TRUE(model.activate(contact.set()));
    ASSERT_EQ(model.size() > kSlaves / 2, GetParam() < 0.0);
    ASSERT_EQ(changes(brain, model, z), 0);
    for (const int most : {0, 3, 20, kSlaves}) {
      const double t = reach.along(step, contact.penetration(), most);
      if (t == ContactReach::kShortest) continue;
      EXPECT_LE(changes(brain, model, z + (t - 1e-9) * step), most);
      if (t == 1.0) continue;
      EXPECT_GT(changes(brain, model, z + (t + 1e-9) * step), most);
      ++shortened;
    }
    EXPECT_EQ(reach.along(step, contact.penetration(), kSlaves), 1.0);
  }
  EXPECT_GT(shortened, 10) << "the test shows nothing";
}

TEST(ContactReach, SlavesThatTheLinearModelHasWrongAlreadyDoNotCount) {
  Skull skull;
  auto& [brain, team, system, model, contact, reach] = skull;
  ASSERT_TRUE(model.activate(contact::ActiveSet(kSlaves)));
  const VecX z = skull_loads(3, 1.0);
  ASSERT_TRUE(contact.solve(z));
  ASSERT_GT(contact.size(), 10);
  // A step of nothing changes nothing, though the model holds every slave for open.
  EXPECT_EQ(reach.along(VecX::Zero(kModes), contact.penetration(), 0), 1.0);
  EXPECT_GT(reach.along(1e-6 * skull_loads(4, 1.0), contact.penetration(), 0),
            ContactReach::kShortest);
}

TEST(ContactReach, WithoutContactEveryStepReachesItsEnd) {
  Skull with, without(false);
  const VecX step = skull_loads(3, 3.0);
  ASSERT_LT(with.reach.along(step, with.contact.penetration(), 0), 1.0);
  EXPECT_EQ(without.reach.along(step, without.contact.penetration(), 0), 1.0);
}

// f_i = max(0, beta P_i), by projected Gauss-Seidel: another method, of no use for large sets.
VecX reference_forces(const CondensedOperators& brain, const VecX& z) {
  const VecX free = brain.initial_penetration_mm - brain.slave_modes * z;
  VecX f = VecX::Zero(kSlaves);
  for (int sweep = 0; sweep < 200000; ++sweep) {
    double change = 0.0;
    for (int i = 0; i < kSlaves; ++i) {
      const double own = brain.compliance(i, i);
      const double depth = free[i] - brain.compliance.row(i).dot(f) + own * f[i];
      const double next = std::max(0.0, depth / (own + 1.0 / kBeta));
      change = std::max(change, std::abs(next - f[i]));
      f[i] = next;
    }
    if (change < 1e-14) break;
  }
  return f;
}

struct Search {
  explicit Search(const CondensedOperators& brain, bool contact = true)
      : team(1),
        system(brain, kWindow, kBeta, team),
        at_loads(brain, kWindow, kBeta, contact, system, team) {}
  ThreadTeam team;
  ContactSystem system;
  ContactAtLoads at_loads;
};

void expect_solution(const CondensedOperators& brain, const VecX& z, const ContactAtLoads& found) {
  const VecX f = reference_forces(brain, z);
  VecX all = VecX::Zero(kSlaves);
  for (int j = 0; j < found.size(); ++j) {
    all[found.active()[static_cast<std::size_t>(j)]] = found.forces()[j];
  }
  EXPECT_LT((all - f).cwiseAbs().maxCoeff(), 1e-6);
  const VecX depth = brain.initial_penetration_mm - brain.slave_modes * z - brain.compliance * f;
  EXPECT_LT((found.penetration() - depth).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LE(found.violation_mm(), kContactViolation_mm);
}

TEST(ContactAtLoads, SolvesContactFromAnyStart) {
  const CondensedOperators brain = skull_operators(0.5);
  Search search(brain);
  int largest = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const VecX z = skull_loads(seed, 0.5 * static_cast<double>(seed));
    ASSERT_TRUE(search.at_loads.solve(z));
    expect_solution(brain, z, search.at_loads);
    largest = std::max(largest, search.at_loads.size());
  }
  EXPECT_GT(largest, kSlaves / 4) << "the test shows nothing";
}

TEST(ContactAtLoads, FindsTheSameWhateverTheSearchBeganWith) {
  const CondensedOperators brain = skull_operators(0.5);
  Search cold(brain), warm(brain);
  const VecX z = skull_loads(6, 1.0);
  ASSERT_TRUE(warm.at_loads.solve(skull_loads(7, 3.0)));
  ASSERT_TRUE(warm.at_loads.solve(z));
  ASSERT_TRUE(cold.at_loads.solve(z));
  EXPECT_EQ(warm.at_loads.active(), cold.at_loads.active());
  expect_solution(brain, z, warm.at_loads);
  warm.at_loads.forget();
  EXPECT_EQ(warm.at_loads.size(), 0);
}

TEST(ContactAtLoads, FindsTheSameFromForcesThatAreGiven) {
  const CondensedOperators brain = skull_operators(0.5);
  Search search(brain);
  const VecX z = skull_loads(6, 1.0);
  std::vector<int> slaves;
  for (int i = 0; i < kSlaves; i += 2) slaves.push_back(i);
  Random random(8);
  VecX forces(static_cast<Eigen::Index>(slaves.size()));
  for (double& force : forces) force = 3.0 * random.normal();  // some of them pull
  search.at_loads.begin_from(slaves, forces);
  ASSERT_TRUE(search.at_loads.solve(z));
  expect_solution(brain, z, search.at_loads);
  // From the solution itself one set is enough.
  const VecX solution = search.at_loads.forces();
  search.at_loads.begin_from(std::vector<int>(search.at_loads.active()), solution);
  ASSERT_TRUE(search.at_loads.solve(z));
  EXPECT_EQ(search.at_loads.sets(), 1);
}

// Where slaves also pull on each other, the exchange of those that pull and those that penetrate
// goes in circles. Projected steps go on.
TEST(ContactAtLoads, SolvesContactWhereExchangesGoInCircles) {
  CondensedOperators brain = skull_operators(0.5);
  Random random(17);
  Eigen::MatrixXd any(kSlaves, kSlaves / 2);
  for (double& value : any.reshaped()) value = random.normal();
  brain.compliance = any * any.transpose();
  Search search(brain);
  int longest = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const VecX z = skull_loads(seed, 1.0);
    search.at_loads.forget();
    ASSERT_TRUE(search.at_loads.solve(z));
    expect_solution(brain, z, search.at_loads);
    longest = std::max(longest, search.at_loads.sets());
  }
  EXPECT_GT(longest, ContactAtLoads::kPlainSets) << "the test shows nothing";
}

TEST(ContactAtLoads, ASearchThatIsGivenUpLeavesTheSolutionThatItKept) {
  const CondensedOperators brain = skull_operators(0.5);
  Search search(brain);
  const VecX z = skull_loads(6, 1.0), other = skull_loads(7, 3.0);
  ASSERT_EQ(value_or_fail(search.at_loads.solve(z)), true);
  search.at_loads.keep();
  const std::vector<int> active = search.at_loads.active();
  int asked = 0;
  const auto third = [&asked] { return ++asked > 2; };
  EXPECT_FALSE(value_or_fail(search.at_loads.solve(other, third)));
  EXPECT_EQ(search.at_loads.sets(), 2);
  search.at_loads.return_to_kept();
  EXPECT_EQ(search.at_loads.active(), active);
  expect_solution(brain, z, search.at_loads);
  EXPECT_TRUE(value_or_fail(search.at_loads.solve(other)));
  expect_solution(brain, other, search.at_loads);
}

TEST(ContactAtLoads, ReturnsToTheSolutionThatItKept) {
  const CondensedOperators brain = skull_operators(0.5);
  Search search(brain);
  const VecX z = skull_loads(6, 1.0);
  ASSERT_TRUE(search.at_loads.solve(z));
  ASSERT_GT(search.at_loads.size(), 10);
  search.at_loads.keep();
  const VecX forces = search.at_loads.forces(), depth = search.at_loads.penetration();
  const std::vector<int> active = search.at_loads.active();
  ASSERT_TRUE(search.at_loads.solve(skull_loads(7, 3.0)));
  ASSERT_NE(search.at_loads.active(), active);
  search.at_loads.return_to_kept();
  EXPECT_EQ(search.at_loads.active(), active);
  EXPECT_EQ(search.at_loads.forces(), forces);
  EXPECT_EQ(search.at_loads.penetration(), depth);
  VecX adjoint = VecX::Zero(kModes), expected = VecX::Zero(kModes);
  ASSERT_TRUE(search.at_loads.add_adjoint(forces, adjoint));
  ASSERT_TRUE(search.at_loads.solve(z));
  ASSERT_TRUE(search.at_loads.add_adjoint(forces, expected));
  EXPECT_LT((adjoint - expected).norm(), 1e-10 * expected.norm());
}

TEST(ContactAtLoads, WithoutContactNothingTouches) {
  const CondensedOperators brain = skull_operators(0.5);
  Search search(brain, false);
  const VecX z = skull_loads(3, 2.0);
  ASSERT_TRUE(search.at_loads.solve(z));
  EXPECT_EQ(search.at_loads.size(), 0);
  const VecX depth = brain.initial_penetration_mm - brain.slave_modes * z;
  ASSERT_GT(depth.maxCoeff(), 0.1);
  EXPECT_LT((search.at_loads.penetration() - depth).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ContactAtLoads, ACompliantSkullThatCannotBeFactorisedIsRejected) {
  CondensedOperators brain = skull_operators(0.0);
  brain.compliance *= -1.0;
  Search search(brain);
  refusal_of(search.at_loads.solve(skull_loads(3, 1.0)), ErrorCode::kSingularMatrix);
}

}  // namespace
}  // namespace brainshift::inversion
