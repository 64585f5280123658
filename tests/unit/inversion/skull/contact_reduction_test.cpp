// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "common/inversion/skull/contact_at_loads.hpp"
#include "common/inversion/skull/contact_reduction.hpp"
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
  ContactReduction model(brain, window, some_modes);
  const VecX z = skull_loads(3, 1.0), step = skull_loads(4, 1e-5);
  ASSERT_TRUE(contact.solve(z));
  ASSERT_GT(contact.size(), 10);
  ASSERT_TRUE(model.activate(contact.set()));
  const VecX forces = contact.forces(), penetration = contact.penetration();
  ASSERT_TRUE(contact.solve(z + step));
  ASSERT_EQ(contact.set(), model.set()) << "the step is too long for the test";

  const VecX dg = step.head(kBefore), dz = step.tail(window.count);
  const auto before = model.response_before();
  ASSERT_TRUE(before);
  const VecX df = -*before * dg - model.response().leftCols(window.count) * dz;
  const VecX change = model.penetration_change(dg, dz, df);
  ASSERT_GT(change.norm(), 1e-6);
  EXPECT_LT((contact.forces() - forces - df).norm(), 1e-6 * df.norm());
  EXPECT_LT((contact.penetration() - penetration - change).norm(), 1e-6 * change.norm());
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
  explicit Skull(bool with_contact = true)
      : contact(brain, kWindow, kBeta, with_contact, system, team),
        reach(brain, kWindow, kBeta, with_contact, model, team) {}
  CondensedOperators brain = skull_operators(0.5);
  ThreadTeam team{2};
  ContactSystem system{brain, kWindow, kBeta, team};
  ContactReduction model{brain, kWindow, system};
  ContactAtLoads contact;
  ContactReach reach;
};

TEST(ContactReach, EndsWhereSoManySlavesOfTheLinearModelHaveChanged) {
  Skull skull;
  auto& [brain, team, system, model, contact, reach] = skull;
  int shortened = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const VecX z = skull_loads(seed, 0.5), step = skull_loads(seed + 20, 2.0);
    ASSERT_TRUE(contact.solve(z));
    ASSERT_TRUE(model.activate(contact.set()));
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

}  // namespace
}  // namespace brainshift::inversion
