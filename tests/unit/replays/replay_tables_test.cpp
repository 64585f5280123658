// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/replay_tables.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/temporary_folder.hpp"
#include "tests/unit/replays/made_up_rows.hpp"

namespace brainshift::replays {
namespace {

using surgeries::Rows;
using testing::HasSubstr;

// A cold one, then 20, 30, 40, 50 and 60.
const std::vector<double> kLatencies = {500, 60, 20, 50, 30, 40};

StageTimes of(const std::vector<StageTimes>& all, const std::string& stage) {
  for (const StageTimes& one : all) {
    if (one.stage == stage) return one;
  }
  ADD_FAILURE() << stage << " is missing";
  return {};
}

TEST(StageTimes, InterpolateBetweenOrderStatisticsWithoutTheColdUpdate) {
  const auto table = table_of(pass_of(kLatencies));
  const auto all = stage_times(Rows(table));
  ASSERT_EQ(all.size(), stage_names().size());
  const StageTimes latency = of(all, "latency");
  EXPECT_EQ(latency.updates, 5);
  EXPECT_DOUBLE_EQ(latency.p50_ms, 40.0);
  EXPECT_DOUBLE_EQ(latency.p95_ms, 58.0);  // four fifths of the way from 50 to 60
  EXPECT_DOUBLE_EQ(latency.p99_ms, 59.6);
  EXPECT_DOUBLE_EQ(latency.max_ms, 60.0);
  EXPECT_DOUBLE_EQ(latency.p50_solves, 4.0);
  EXPECT_DOUBLE_EQ(latency.p95_solves, 5.8);
  EXPECT_DOUBLE_EQ(of(all, "journal").p50_ms, 4.0);
}

TEST(StageTimes, AreDividedByTheSolveOfTheirOwnRow) {
  auto rows = joined(pass_of({1, 20, 20}), pass_of({1, 80, 80}, "1x", "2"));
  for (Texts& row : rows) {
    if (row["pass"] == "2") row["t_solve_ms"] = "40";  // four times as slow all over
  }
  const auto table = table_of(rows);
  const StageTimes latency = of(stage_times(Rows(table)), "latency");
  EXPECT_DOUBLE_EQ(latency.p50_solves, 2.0);
  EXPECT_DOUBLE_EQ(latency.p95_solves, 2.0);
}

TEST(StageTimes, KeepSpeedsAndSurgeriesApart) {
  auto other = pass_of({1, 7, 7});
  for (Texts& row : other) row["surgery"] = "other";
  const auto table =
      table_of(joined(joined(pass_of({1, 20, 20}), pass_of({1, 5, 5}, "max")), other));
  const auto all = stage_times(Rows(table));
  ASSERT_EQ(all.size(), 3 * stage_names().size());
  EXPECT_DOUBLE_EQ(all[stage_names().size() - 1].p50_ms, 20.0);
  EXPECT_EQ(all[stage_names().size()].speed, "max");
  EXPECT_DOUBLE_EQ(all[2 * stage_names().size() - 1].p50_ms, 5.0);
  EXPECT_EQ(all.back().surgery, "other");
}

TEST(StageTimes, ObservationsWithoutAFieldHaveNone) {
  auto rows = pass_of(kLatencies);
  rows[1] = {{"surgery", "sag"}, {"speed", "1x"}, {"update", "2"}, {"outcome", "superseded"}};
  const auto table = table_of(rows);
  EXPECT_EQ(of(stage_times(Rows(table)), "latency").updates, 4);
}

TEST(Jitter, IsTheSpreadOfTheLatency) {
  auto rows = pass_of(kLatencies);
  rows[3]["sent_late_ms"] = "1.5";
  const auto table = table_of(rows);
  const auto all = jitter(Rows(table));
  ASSERT_EQ(all.size(), 1u);
  EXPECT_DOUBLE_EQ(all[0].cold_p50_ms, 500.0);
  EXPECT_DOUBLE_EQ(all[0].spread_ms, 18.0);
  EXPECT_DOUBLE_EQ(all[0].sd_ms, std::sqrt(250.0));
  EXPECT_DOUBLE_EQ(all[0].sent_late_ms, 1.5);
}

TEST(Jitter, NothingIsSentLateAtFullSpeed) {
  const auto table = table_of(pass_of(kLatencies, "max"));
  EXPECT_TRUE(std::isnan(jitter(Rows(table))[0].sent_late_ms));
}

TEST(StageRatios, CompareInUnitsOfTheSolve) {
  const auto committed = table_of(pass_of({1, 20, 20, 20}));
  auto slower = pass_of({1, 60, 60, 60});
  for (Texts& row : slower) row["t_solve_ms"] = "20";  // half of that is the machine
  const auto now = table_of(slower);
  const auto ratios = stage_ratios(Rows(now), Rows(committed));
  ASSERT_EQ(ratios.size(), 2 * stage_names().size());
  EXPECT_EQ(ratios.back().stage, "latency");
  EXPECT_EQ(ratios.back().quantile, "p95");
  EXPECT_DOUBLE_EQ(ratios.back().now_solves, 3.0);
  EXPECT_DOUBLE_EQ(ratios.back().committed_solves, 2.0);
  EXPECT_DOUBLE_EQ(ratios.back().ratio, 1.5);
}

TEST(StageRatios, WhatTakesNextToNothingHasNoRatioOfItsOwn) {
  auto rows = pass_of({1, 20, 20});
  for (Texts& row : rows) row["journal_ms"] = "0.01";
  const auto committed = table_of(rows);
  for (Texts& row : rows) row["journal_ms"] = "0.4";
  const auto now = table_of(rows);
  const auto ratios = stage_ratios(Rows(now), Rows(committed));
  EXPECT_EQ(ratios.size(), 2 * (stage_names().size() - 1));
  for (const StageRatio& one : ratios) EXPECT_NE(one.stage, "journal");
  for (Texts& row : rows) row["journal_ms"] = "5";
  const auto slow = table_of(rows);
  double worst = 0.0;
  for (const StageRatio& one : stage_ratios(Rows(slow), Rows(committed))) {
    worst = std::max(worst, one.ratio);
  }
  EXPECT_DOUBLE_EQ(worst, 10.0);  // 0.5 solves over the floor of 0.05
}

TEST(StageRatios, NeedTheSameHeadMeshAndObservations) {
  const auto rows = pass_of({1, 20, 20});
  const auto now = table_of(rows);
  EXPECT_EQ(not_comparable(Rows(now), Rows(now)), "");
  const bench::CsvTable none = table_of({});
  EXPECT_THAT(not_comparable(Rows(now), Rows(none)), HasSubstr("no committed rows"));
  const std::pair<const char*, const char*> changes[] = {
      {"head", "other"}, {"nodes", "101"}, {"seed", "2"}, {"source", "tracks"}, {"sequence", "9"}};
  for (const auto& [column, text] : changes) {
    auto other = rows;
    other.back()[column] = text;
    other.front()[column] = text;
    const auto committed = table_of(other);
    EXPECT_NE(not_comparable(Rows(now), Rows(committed)), "") << column;
    EXPECT_TRUE(stage_ratios(Rows(now), Rows(committed)).empty()) << column;
  }
}

TEST(StageRatios, MorePassesOfTheSameObservationsCanBeCompared) {
  const auto once = table_of(pass_of({1, 20, 20}));
  const auto twice = table_of(joined(pass_of({1, 20, 20}), pass_of({1, 20, 20}, "1x", "2")));
  EXPECT_EQ(not_comparable(Rows(once), Rows(twice)), "");
}

TEST(ReplayTables, AreWrittenForEverySurgerySpeedAndStage) {
  const test_support::TemporaryFolder folder;
  const auto table = table_of(joined(pass_of(kLatencies), pass_of(kLatencies, "max")));
  ASSERT_TRUE(write_tables(Rows(table), folder.path()));
  const auto written = bench::CsvTable::read(folder / "percentiles.csv");
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_EQ(written->rows(), 2 * stage_names().size());
  EXPECT_DOUBLE_EQ(written->number(5, "p95_ms"), 58.0);
  const std::string text = test_support::content_of(folder / "latency.md");
  EXPECT_THAT(text, HasSubstr("| `sag` | 1x | 5 | 40.0 | 58.0 | 59.6 | 60.0 | 4.00 | 500.0 |"));
  EXPECT_THAT(text, HasSubstr("kernel Any"));
  EXPECT_EQ(write_tables(Rows(table), folder / "none").error().code, ErrorCode::kWriteFailed);
}

}  // namespace
}  // namespace brainshift::replays
