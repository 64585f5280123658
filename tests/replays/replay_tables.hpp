// SPDX-License-Identifier: GPL-3.0-or-later
// What the rows of `replays` say: percentiles of every stage, jitter, and the comparison with the
// rows of an earlier run. A surgery at one speed is one entry.
//
// The first update of every session is cold and stands apart, as in BENCHMARK.md. Times in units of
// t_solve are divided row by row, by the t_solve of the row.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "tests/surgeries/surgery_table.hpp"

namespace brainshift::replays {

// Names of the stages, in order; the column of the table is NAME_ms. The last one is the latency at
// the client, in which all others are.
const std::vector<std::string>& stage_names();

struct StageTimes {
  std::string surgery, speed, stage;
  int updates = 0;  // without the first of every session
  double p50_ms = 0.0, p95_ms = 0.0, p99_ms = 0.0, max_ms = 0.0;
  double p50_solves = 0.0, p95_solves = 0.0;
};
// Every surgery, speed and stage that has an update, in the order of the rows.
std::vector<StageTimes> stage_times(const surgeries::Rows& rows);

struct Jitter {
  std::string surgery, speed;
  double cold_p50_ms = 0.0;   // latency of the first updates
  double spread_ms = 0.0;     // of the latency: p95 - p50
  double sd_ms = 0.0;         // sample standard deviation of the latency
  double sent_late_ms = 0.0;  // largest lateness of the sender; NaN at full speed
};
std::vector<Jitter> jitter(const surgeries::Rows& rows);

// How much longer a stage takes than in the committed run, both in units of t_solve:
//   max(now, kLeastSolves) / max(committed, kLeastSolves)
// What takes less than kLeastSolves (2 ms) counts as that, since its ratio would be noise; where
// both do, there is none.
inline constexpr double kLeastSolves = 0.05;
struct StageRatio {
  std::string stage, quantile;  // "p50" or "p95"
  double now_solves = 0.0, committed_solves = 0.0;
  double ratio = 0.0;
};
// Of one surgery at one speed. Empty when the runs cannot be compared.
std::vector<StageRatio> stage_ratios(const surgeries::Rows& now, const surgeries::Rows& committed);

// Why rows of one surgery and speed cannot be compared with the committed ones: no such rows,
// another head, another mesh, other observations. Empty when they can.
std::string not_comparable(const surgeries::Rows& now, const surgeries::Rows& committed);

// percentiles.csv with a row per StageTimes, and latency.md with the tables of docs/replays.md.
// kWriteFailed.
Status write_tables(const surgeries::Rows& rows, const std::filesystem::path& folder);

}  // namespace brainshift::replays
