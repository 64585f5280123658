// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/guard/token_bucket.hpp"

#include <gtest/gtest.h>

namespace brainshift::server {
namespace {

TEST(TokenBucket, GivesTheBurstAtOnceAndThenTheRate) {
  const TokenBucket::TimePoint start{};
  TokenBucket bucket(10.0, 5.0, start);
  int taken = 0;
  while (bucket.take(start)) ++taken;
  EXPECT_EQ(taken, 5);
  EXPECT_FALSE(bucket.take(start + std::chrono::milliseconds(99)));
  EXPECT_TRUE(bucket.take(start + std::chrono::milliseconds(201)));
  taken = 0;
  for (int ms = 202; ms < 10'202; ++ms)
    taken += bucket.take(start + std::chrono::milliseconds(ms)) ? 1 : 0;
  EXPECT_NEAR(taken, 100, 1);
}

TEST(TokenBucket, HoldsNoMoreThanItsBurstHoweverLongItRests) {
  const TokenBucket::TimePoint start{};
  TokenBucket bucket(1000.0, 3.0, start);
  const auto later = start + std::chrono::hours(24);
  int taken = 0;
  while (bucket.take(later)) ++taken;
  EXPECT_EQ(taken, 3);
}

TEST(TokenBucket, WhatIsSpentBeyondItIsFilledInFirst) {
  const TokenBucket::TimePoint start{};
  TokenBucket bucket(1000.0, 500.0, start);
  EXPECT_TRUE(bucket.has_one(start));
  bucket.spend(600);
  EXPECT_FALSE(bucket.has_one(start));
  EXPECT_FALSE(bucket.has_one(start + std::chrono::milliseconds(99)));
  EXPECT_TRUE(bucket.has_one(start + std::chrono::milliseconds(102)));
}

}  // namespace
}  // namespace brainshift::server
