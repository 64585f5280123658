// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <chrono>

#include "server/guard/connection.hpp"

namespace brainshift::server {
namespace {

using std::chrono::milliseconds;

TEST(Allowance, GivesABurstAndThenTheRateAndSavesNoMoreThanABurst) {
  const Allowance::TimePoint start{};
  Allowance allowance(1000.0, 500.0, start);
  EXPECT_TRUE(allowance.left(start));
  allowance.spend(600);  // what was read at once may go beyond, and is owed
  EXPECT_FALSE(allowance.left(start));
  EXPECT_FALSE(allowance.left(start + milliseconds(99)));
  EXPECT_TRUE(allowance.left(start + milliseconds(101)));
  EXPECT_TRUE(allowance.left(start + milliseconds(60'000)));
  allowance.spend(500);
  EXPECT_FALSE(allowance.left(start + milliseconds(60'000)));
}

}  // namespace
}  // namespace brainshift::server
