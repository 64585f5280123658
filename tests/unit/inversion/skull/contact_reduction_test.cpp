// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/contact_reduction.hpp"

#include <gtest/gtest.h>

#include "common/inversion/skull/contact_at_loads.hpp"
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

}  // namespace
}  // namespace brainshift::inversion
