// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/source_clock.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "tests/unit/server/sample_values.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kHour = 3600 * kSecond;
constexpr double kMaxAge_s = 120.0;

Observation seen(std::int64_t acquired_ns, std::int64_t sent_ns = 0) {
  Observation observation = landmarks(1, "ius");
  observation.acquired_ns = acquired_ns;
  observation.sent_ns = sent_ns;
  return observation;
}

void expect_refused(const Result<std::int64_t>& time, const std::string& why) {
  ASSERT_FALSE(time);
  EXPECT_EQ(time.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(time.error().message, HasSubstr(why));
}

// Whatever the source's clock shows, only differences count.
TEST(SourceClock, TheFastestMessageSetsTheOffset) {
  for (const std::int64_t zero : {std::int64_t{0}, kHour, -kHour, 100'000 * kHour}) {
    SourceClock clock(kMaxAge_s);
    EXPECT_EQ(clock.to_daemon(seen(zero), 500 * kSecond).value(), 500 * kSecond);
    EXPECT_EQ(clock.to_daemon(seen(zero + 10 * kSecond), 512 * kSecond).value(), 510 * kSecond)
        << "2 s under way";
    EXPECT_EQ(clock.to_daemon(seen(zero + 20 * kSecond), 519 * kSecond).value(), 519 * kSecond)
        << "the first one took 1 s more";
    EXPECT_EQ(clock.to_daemon(seen(zero + 30 * kSecond), 530 * kSecond).value(), 529 * kSecond);
  }
}

TEST(SourceClock, AnOldDatumIsRefusedAndTheNextFreshOneIsTaken) {
  SourceClock clock(kMaxAge_s);
  ASSERT_TRUE(clock.to_daemon(seen(0), 0));
  expect_refused(clock.to_daemon(seen(kSecond), kHour), "3599 s old when it arrived");
  EXPECT_EQ(clock.to_daemon(seen(kHour), kHour + kSecond).value(), kHour);
}

TEST(SourceClock, WithTheTimeOfHandOverTheFirstOneCanBeRefusedToo) {
  SourceClock clock(kMaxAge_s);
  expect_refused(clock.to_daemon(seen(0, kHour), 5 * kSecond), "3600 s old when it arrived");
  expect_refused(clock.to_daemon(seen(kSecond, 0 - kSecond), 5 * kSecond), "2 s after it was sent");
  EXPECT_EQ(clock.to_daemon(seen(kHour, kHour + kSecond), 7 * kSecond).value(), 6 * kSecond);
}

TEST(SourceClock, OneStampThatIsAheadChangesNothing) {
  SourceClock clock(kMaxAge_s);
  ASSERT_TRUE(clock.to_daemon(seen(0), 0));
  expect_refused(clock.to_daemon(seen(kHour), kSecond), "jumped ahead by 3599 s");
  EXPECT_EQ(clock.to_daemon(seen(2 * kSecond), 2 * kSecond).value(), 2 * kSecond);
}

TEST(SourceClock, ASourceThatHasSetItsClockIsFollowed) {
  SourceClock clock(kMaxAge_s);
  ASSERT_TRUE(clock.to_daemon(seen(0), 0));
  EXPECT_FALSE(clock.to_daemon(seen(kHour), kSecond));
  EXPECT_EQ(clock.to_daemon(seen(kHour + kSecond), 2 * kSecond).value(), 2 * kSecond);
}

TEST(SourceClock, WhatWasAcquiredBeforeTheLastOneIsRefused) {
  SourceClock clock(kMaxAge_s);
  ASSERT_TRUE(clock.to_daemon(seen(10 * kSecond), 10 * kSecond));
  expect_refused(clock.to_daemon(seen(8 * kSecond), 11 * kSecond), "2 s before the one before it");
  EXPECT_TRUE(clock.to_daemon(seen(10 * kSecond), 12 * kSecond)) << "the same instant is no error";
}

TEST(SourceClock, StampsThatNoClockShowsAreRefused) {
  using Limits = std::numeric_limits<std::int64_t>;
  for (const std::int64_t stamp : {Limits::min(), Limits::max(), SourceClock::kMaxStamp_ns + 1}) {
    SourceClock clock(kMaxAge_s);
    expect_refused(clock.to_daemon(seen(stamp), 0), "acquired_ns");
    expect_refused(clock.to_daemon(seen(0, stamp), 0), "sent_ns");
    expect_refused(recorded_time(seen(stamp)), "acquired_ns");
  }
  EXPECT_EQ(recorded_time(seen(-kHour)).value(), -kHour);
}

}  // namespace
}  // namespace brainshift::server
