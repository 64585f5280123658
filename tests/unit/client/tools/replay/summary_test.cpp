// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>

#include "client/tools/replay/replay.hpp"
#include "tests/unit/client/tools/replay/scripted_daemon.hpp"

namespace brainshift::client {
namespace {

TEST(Summary, PercentilesLeaveOutTheFirstUpdateWhichIsTheColdOne) {
  PlayedSession session;
  for (int i = 1; i <= 5; ++i) {
    PlayedObservation observation;
    observation.sequence = static_cast<std::uint64_t>(i);
    observation.latency_ms = 100.0 * (6 - i);  // 500, 400, ... 100
    observation.first_iterate_ms = 10.0 * i;
    observation.timings.invert_ms = i == 5 ? 1000.0 : i;
    session.observations.push_back(observation);
  }
  RunReport run;
  summarise(session, run);
  EXPECT_EQ(run.updates, 5);
  EXPECT_DOUBLE_EQ(run.latency_ms->p50, 250.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->p95, 385.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->p99, 397.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->max, 400.0);
  EXPECT_DOUBLE_EQ(*run.cold_ms, 500.0);
  EXPECT_DOUBLE_EQ(*run.first_iterate_ms, 30.0);
  EXPECT_DOUBLE_EQ(run.stages_ms->invert_ms, 3.0);
}

TEST(Summary, ASingleUpdateIsBothTheColdOneAndTheLatency) {
  PlayedSession session;
  session.observations.resize(1);
  session.observations[0].latency_ms = 70.0;
  RunReport run;
  summarise(session, run);
  EXPECT_DOUBLE_EQ(*run.cold_ms, 70.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->p50, 70.0);
  EXPECT_DOUBLE_EQ(run.latency_ms->max, 70.0);
}

TEST(Summary, WithoutUpdatesTimesStayEmpty) {
  RunReport run;
  summarise(PlayedSession{}, run);
  EXPECT_EQ(run.updates, 0);
  EXPECT_FALSE(run.latency_ms);
  EXPECT_FALSE(run.cold_ms);
  EXPECT_FALSE(run.stages_ms);
}

TEST(Summary, TheWorstVerdictOfARunStands) {
  const Quality order[] = {Quality::kGood, Quality::kCaution, Quality::kNotJudged,
                           Quality::kUnusable};  // ever worse
  PlayedSession session;
  for (const Quality quality : order) {
    PlayedObservation observation;
    observation.latency_ms = 1.0;
    observation.quality.quality = quality;
    session.observations.push_back(observation);
    std::rotate(session.observations.rbegin(), session.observations.rbegin() + 1,
                session.observations.rend());
    RunReport run;
    summarise(session, run);
    ASSERT_TRUE(run.quality);
    EXPECT_EQ(run.quality->worst, to_string(quality));
  }
}

TEST(Summary, WithoutUpdatesThereIsNoQuality) {
  RunReport run;
  summarise(PlayedSession{}, run);
  EXPECT_FALSE(run.quality);
}

TEST(SummaryLine, CountsVerdictsFlagsAndFailures) {
  RunReport run;
  run.scenario = "paper";
  run.method = "condensed";
  run.boundary = "contact";
  EXPECT_EQ(summary_line(run), "paper, condensed, contact: 0 updates");
  run.updates = 1;
  run.quality = RunQuality{"good", "good", "", {1, 0, 0, 0}, {}};
  EXPECT_EQ(summary_line(run), "paper, condensed, contact: 1 update (1 good)");
  run.updates = 12;
  run.quality = RunQuality{
      "unusable", "caution", "", {7, 2, 1, 2}, {{"deadline", 2}, {"inverted_elements", 1}}};
  run.failures.resize(3);
  run.recovery_pct = 97.66;
  EXPECT_EQ(summary_line(run),
            "paper, condensed, contact: 12 updates (7 good, 2 with caution, 1 unusable, 2 not "
            "judged); deadline 2, inverted_elements 1; 3 failed; 97.7 % recovered at the tumour");
}

TEST(Trace, PairsHistoryWithTheIteratesThatArrived) {
  PlayedSession session;
  session.last = update(1, true, 3).update;
  session.iterates = {{1, Points::Constant(3, 2, 4.0)}, {3, Points::Constant(3, 2, 6.0)}};
  const auto trace = trace_of(session, [](const Points& u) { return MeanStd{u(0, 0), 0.0}; });
  ASSERT_EQ(trace.size(), 3u);
  EXPECT_DOUBLE_EQ(trace[0].cross->mean, 4.0);
  EXPECT_FALSE(trace[1].cross);
  EXPECT_DOUBLE_EQ(trace[2].cross->mean, 6.0);
  EXPECT_DOUBLE_EQ(trace[1].sparse.mean, 0.5);
  EXPECT_EQ(trace[2].penetrating, 7);
  EXPECT_DOUBLE_EQ(trace[1].elapsed_ms, 200.0);
}

}  // namespace
}  // namespace brainshift::client
