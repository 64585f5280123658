// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/contract/penetration.hpp"

#include <gtest/gtest.h>

namespace brainshift::inversion {
namespace {

TEST(Penetration, CountsSlavesAboveTheToleranceAndKeepsTheDeepest) {
  const PenetrationSummary summary =
      summarise_penetration(VecX{{-2.0, 0.5 * kPenetrationTolerance_mm, 0.3, 0.0, 1.5}});
  EXPECT_EQ(summary.penetrating, 2);
  EXPECT_EQ(summary.max_mm, 1.5);
}

TEST(Penetration, OfOpenSlavesAndOfNoneIsZero) {
  for (const VecX& open : {VecX{{-1.0, -0.1}}, VecX()}) {
    const PenetrationSummary summary = summarise_penetration(open);
    EXPECT_EQ(summary.penetrating, 0);
    EXPECT_EQ(summary.max_mm, 0.0);
  }
}

}  // namespace
}  // namespace brainshift::inversion
