// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/volume/outside_taper.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace brainshift::client {
namespace {

TEST(OutsideTaper, IsOneThenACosineThenZero) {
  const OutsideTaper taper;
  EXPECT_EQ(taper.factor(0.0), 1.0);
  EXPECT_EQ(taper.factor(5.0), 1.0);
  EXPECT_NEAR(taper.factor(8.75), 0.8535533905932737, 1e-15);  // (1 + cos 45 degrees) / 2
  EXPECT_NEAR(taper.factor(12.5), 0.5, 1e-15);
  EXPECT_EQ(taper.factor(20.0), 0.0);
  EXPECT_EQ(taper.factor(1e9), 0.0);
}

TEST(OutsideTaper, FallsNowhereFasterThanItsHeaderSays) {
  const OutsideTaper taper;
  double steepest = 0.0;
  for (double d = 0.0; d < 25.0; d += 0.01) {
    const double fall = taper.factor(d) - taper.factor(d + 0.01);
    EXPECT_GE(fall, 0.0);
    steepest = std::max(steepest, fall / 0.01);
  }
  EXPECT_NEAR(steepest, 1.0 / 9.549, 1e-4);
}

TEST(OutsideTaper, RefusesAnOrderThatIsNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(validate(OutsideTaper{}));
  EXPECT_TRUE(validate(OutsideTaper{0.0, 1000.0}));
  for (const OutsideTaper& bad :
       {OutsideTaper{-1, 5}, OutsideTaper{5, 5}, OutsideTaper{6, 5}, OutsideTaper{5, 1001},
        OutsideTaper{nan, 5}, OutsideTaper{5, nan}}) {
    const Status refused = validate(bad);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace brainshift::client
