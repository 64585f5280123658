// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/counters.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

namespace brainshift::server {
namespace {

using std::chrono::milliseconds;
using wire::SourceCounts;

class CountersTest : public testing::Test {
 protected:
  wire::DaemonReport report() const {
    wire::DaemonReport result;
    counters_.report(result, now_);
    return result;
  }
  SourceCounts of(const std::string& source) const {
    for (const SourceCounts& counts : report().sources) {
      if (counts.source == source) return counts;
    }
    ADD_FAILURE() << "no row " << source;
    return {};
  }
  void decide(const std::string& source, Outcome outcome) {
    Decision decision;
    decision.source = source;
    decision.outcome = outcome;
    counters_.decided(decision);
  }

  Counters::TimePoint now_{std::chrono::seconds(100)};
  Counters counters_;
};

TEST_F(CountersTest, EveryMessageIsCountedWithWhatBecameOfIt) {
  for (int i = 0; i < 6; ++i) counters_.accepted("ius", now_);
  for (const Outcome outcome : {Outcome::kUsed, Outcome::kUsed, Outcome::kFailed,
                                Outcome::kSuperseded, Outcome::kSkipped}) {
    decide("ius", outcome);
  }
  counters_.refused("ius", now_);
  counters_.repeated("ius", now_);
  EXPECT_EQ(of("ius"), (SourceCounts{"ius", 8, 2, 1, 1, 1, 1, 1, 1, 0.0}));
}

TEST_F(CountersTest, AgeIsThatOfTheLastMessageOfASource) {
  counters_.accepted("ius", now_);
  counters_.accepted("pointer", now_);
  now_ += milliseconds(250);
  counters_.refused("ius", now_);
  now_ += milliseconds(250);
  EXPECT_DOUBLE_EQ(of("ius").age_ms, 250.0);
  EXPECT_DOUBLE_EQ(of("pointer").age_ms, 500.0);
}

// Else a peer could fill the daemon's memory with names.
TEST_F(CountersTest, WhatIsRefusedMakesNoRow) {
  for (int i = 0; i < 1000; ++i) counters_.refused("source " + std::to_string(i), now_);
  counters_.refused("", now_);
  ASSERT_EQ(report().sources.size(), 1u);
  EXPECT_EQ(of("").refused, 1001u);
  EXPECT_EQ(of("").received, 1001u);
}

TEST_F(CountersTest, BeyondTheRowsNothingIsLost) {
  constexpr std::size_t kSources = Counters::kMaxSources + 10;
  for (std::size_t i = 0; i < kSources; ++i) counters_.accepted(std::to_string(i), now_);
  for (std::size_t i = 0; i < kSources; ++i) decide(std::to_string(i), Outcome::kUsed);
  EXPECT_EQ(report().sources.size(), Counters::kMaxSources + 1);
  EXPECT_EQ(of("").received, 10u);
  EXPECT_EQ(of("").answered, 10u);
  EXPECT_EQ(of("").waiting, 0u);
}

TEST_F(CountersTest, StagesAreThoseOfTheUpdateAndItsWay) {
  Passage passage;
  passage.arrived = now_;
  passage.begun = now_ + milliseconds(3);
  passage.published = now_ + milliseconds(50);
  passage.timings = {1.5, 20.25, 4.75, 0.5, 0.125};
  passage.usable = true;
  counters_.answered(passage);
  passage.usable = false;
  passage.late = true;
  counters_.answered(passage);
  counters_.failed();
  counters_.iterate();
  const auto result = report();
  EXPECT_EQ(result.usable, 1u);
  EXPECT_EQ(result.unusable, 1u);
  EXPECT_EQ(result.late, 1u);
  EXPECT_EQ(result.failures, 1u);
  EXPECT_EQ(result.iterates, 1u);
  const std::vector<std::pair<std::string, double>> expected = {
      {"wait", 3.0},   {"register", 1.5},  {"invert", 20.25}, {"rebuild", 4.75},
      {"encode", 0.5}, {"journal", 0.125}, {"total", 50.0}};
  ASSERT_EQ(result.stages.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(result.stages[i].stage, expected[i].first);
    EXPECT_EQ(result.stages[i].all.count, 2u);
    EXPECT_DOUBLE_EQ(result.stages[i].recent.max_ms, expected[i].second);
    EXPECT_DOUBLE_EQ(result.stages[i].sum_ms, 2.0 * expected[i].second);
    EXPECT_EQ(result.stages[i].bucket_counts.size(), result.bounds_ms.size() + 1);
  }
  EXPECT_EQ(result.recent_updates, LatencyRecord::kRecent);
}

}  // namespace
}  // namespace brainshift::server
