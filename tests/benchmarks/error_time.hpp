// SPDX-License-Identifier: GPL-3.0-or-later
// Error and run time of inversion methods on simulated surgeries of one head.
//
// Every repetition has its own measurement: the points of the scenario's first observation with
// noise drawn anew. All methods get the same measurements, so that errors can be compared
// repetition by repetition. The estimate sees the measurement only; the score sees the truth.
#pragma once

#include <string>
#include <vector>

#include "client/twin/scenario.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"
#include "tests/benchmarks/bench_head.hpp"

namespace brainshift::bench {

struct Trial {
  std::string scenario;
  io::SurgeryTruth truth;
  std::vector<SparseData> data;  // one per repetition
};

// kInvalidArgument when the scenario's instruments measure no
// displacements and need a registration.
Result<Trial> make_trial(const Head& head, const client::Scenario& scenario, int repetitions,
                         std::uint64_t seed, const Progress& progress = {});

// error_time-*.csv. rank: prior modes used, empty where the method has none. start: "cold" or
// "warm". status: the estimate's, "stopped" (out of time), "not_available" or the code of the
// error. Without an estimate the cells of errors are empty.
inline constexpr const char* kErrorTimeHeading =
    "mesh,nodes,scenario,method,rank,start,repetition,time_ms,time_over_tsolve,cross_mm,"
    "field_mean_mm,field_max_mm,recovery_pct,active,iterations,status,coverage_90,t_solve_ms";

// Times each repetition of one method and writes a row for it. No method keeps anything from one
// update to the next but memory. The condensed method has rows "cold" and, in a second round, rows
// "warm" for those who read the tables by that name; both are the same estimate.
Status run_condensed(const Head& head, const Trial& trial, int rank, CsvWriter& out);
// Ends early when budget_s is used up; a repetition that goes beyond is stopped.
Status run_method(const Head& head, const Trial& trial, Method method, int repetitions,
                  double budget_s, CsvWriter& out);

}  // namespace brainshift::bench
