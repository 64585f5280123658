// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/sources.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "tests/unit/server/sample_values.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kSourceHour = 3'600'000'000'000;

Observation with_stamp(Observation observation, std::int64_t acquired_ns) {
  observation.acquired_ns = acquired_ns;
  return observation;
}

TEST(Sources, WhatIsRefusedTakesNoPlaceAndNoNumber) {
  Sources sources(120.0, false);
  const std::int64_t never = std::numeric_limits<std::int64_t>::max();
  for (std::size_t i = 0; i < 3 * Sources::kMaxSources; ++i) {
    const std::string name = "source " + std::to_string(i);
    EXPECT_FALSE(sources.admit(with_stamp(landmarks(5, name), never), 0, false));
    EXPECT_FALSE(sources.admit(landmarks(0, name), 0, false)) << "no receipt of what never came";
  }
  for (std::size_t i = 0; i < Sources::kMaxSources; ++i) {
    EXPECT_TRUE(sources.admit(landmarks(1, "source " + std::to_string(i)), 0, false));
  }
  const auto full = sources.admit(landmarks(1, "one too many"), 0, false);
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(full.error().message, HasSubstr("16 other sources"));
  EXPECT_TRUE(sources.admit(landmarks(2, "source 0"), 0, false)) << "those known go on";
}

TEST(Sources, ARepetitionGetsTheFirstReceiptAndChangesNothing) {
  Sources sources(120.0, false);
  ASSERT_TRUE(sources.admit(landmarks(4), 0, true));
  const auto again = sources.admit(landmarks(4), kSourceHour, false);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->repeated);
  EXPECT_EQ(again->receipt.observation_sequence, 4u);
  EXPECT_TRUE(again->receipt.replaced_pending);
  EXPECT_FALSE(sources.admit(landmarks(3), 0, false));
  EXPECT_FALSE(sources.admit(landmarks(5), 0, false)->repeated);
}

TEST(Sources, EachHasAClockOfItsOwnAndFollowsOneThatWasSet) {
  Sources sources(120.0, false);
  EXPECT_EQ(sources.admit(with_stamp(landmarks(1, "ius"), kSourceHour), 7, false)->daemon_ns, 7);
  EXPECT_EQ(sources.admit(with_stamp(landmarks(1, "camera"), 0), 9, false)->daemon_ns, 9);
  EXPECT_FALSE(sources.admit(with_stamp(landmarks(2, "camera"), kSourceHour), 10, false));
  EXPECT_EQ(
      sources.admit(with_stamp(landmarks(2, "camera"), kSourceHour + 1), 11, false)->daemon_ns, 11);
}

TEST(Sources, OfARecordingShareItsClock) {
  Sources sources(120.0, true);
  EXPECT_EQ(sources.admit(with_stamp(landmarks(1, "ius"), kSourceHour), 7, false)->daemon_ns,
            kSourceHour);
  EXPECT_EQ(sources.admit(with_stamp(landmarks(2, "ius"), 3), 8, false)->daemon_ns, 3)
      << "a replay that begins again";
}

}  // namespace
}  // namespace brainshift::server
