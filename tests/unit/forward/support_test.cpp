// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/forward/support.hpp"

#include <gtest/gtest.h>

namespace brainshift::forward {
namespace {

TEST(Support, ThreeTwoOneHoldsABodyOfAnySize) {
  for (const double size : {1e-3, 1.0, 1e4}) {
    const Vec3 centre(5.0, 5.0, 5.0);
    const Vec3 a = centre, b = centre + size * Vec3::UnitX(), c = centre + size * Vec3::UnitY();
    std::vector<HeldDirection> held = {{a, Vec3::UnitX()}, {a, Vec3::UnitY()}, {a, Vec3::UnitZ()},
                                       {b, Vec3::UnitY()}, {b, Vec3::UnitZ()}, {c, Vec3::UnitZ()}};
    EXPECT_TRUE(check_support(held, centre, size));
    held.pop_back();
    const Status status = check_support(held, centre, size);
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::kFloatingBody);
    EXPECT_NE(status.error().message.find("1 of its 6 rigid motions is free"), std::string::npos);
  }
}

TEST(Support, NothingHeldLeavesSixMotions) {
  const Status status = check_support({}, Vec3::Zero(), 1.0);
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message.find("6 of its 6"), std::string::npos);
}

}  // namespace
}  // namespace brainshift::forward
