// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/observability.hpp"

#include <gmock/gmock.h>

namespace brainshift::registration {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Observability, SaysWhichAxesThePointsDoNotShow) {
  Observability seen;
  seen.threshold = 0.01;
  seen.rotation_ratios = Vec3(0.001, 0.2, 0.3);
  seen.rotation_axes.col(0) = -Vec3(0.1, 0.9, 0.2).normalized();
  seen.translation_ratios = Vec3(0.0, 0.009, 1.0);
  EXPECT_THAT(not_shown(seen),
              ElementsAre("rotation about (0.11, 0.97, 0.22) is not shown by the points",
                          "translation along (1.00, 0.00, 0.00) is not shown by the points",
                          "translation along (0.00, 1.00, 0.00) is not shown by the points"));
  seen.rotation_ratios.setZero();
  seen.translation_ratios.setOnes();
  EXPECT_THAT(not_shown(seen), ElementsAre("no rotation is shown by the points"));
  seen.rotation_ratios.setOnes();
  EXPECT_THAT(not_shown(seen), IsEmpty());
}

}  // namespace
}  // namespace brainshift::registration
