// SPDX-License-Identifier: GPL-3.0-or-later
// Error and run time of inversion methods on simulated surgeries of one head.
//
// Every repetition is a surgery of its own: the scenario's first moment, varied (fluid level, pose,
// stiffness, swelling; tests/simulation/variation.hpp), with points and noise of its own. All
// methods get the same surgeries, so that errors can be compared one by one. The estimate sees the
// measurement only; the score sees the truth.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client/tools/twin/scenario.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"
#include "tests/benchmarks/bench_head.hpp"

namespace brainshift::bench {

struct PlayedSurgery {
  io::SurgeryTruth truth;
  SparseData data;
};

struct Trial {
  std::string scenario;
  std::vector<PlayedSurgery> surgeries;  // one per repetition
};

// Repetition r is varied and played with seed + r. kInvalidArgument when the scenario's instruments
// measure no displacements and need a registration. Otherwise errors of client::play_scenario.
Result<Trial> make_trial(const Head& head, const client::Scenario& scenario, int repetitions,
                         std::uint64_t seed, const Progress& progress = {});

// What the iterative methods believe of the forces.
struct Prior {
  const char* name = "case";  // or "paper"
  std::shared_ptr<const inversion::PreparedModel> prepared;
};
// The paper's prior: its residual field alone, (1 + r/L) exp(-r/L) with L = 5 mm (section 2.2). The
// paper states no strength; here it is the weight of tissue in air, 9.8 kN/m3, which is what
// drainage can change at most. Errors as PreparedModel::prepare.
Result<Prior> papers_prior(const Head& head);

// error_time-*.csv. prior: "case" or "paper". rank: prior modes used, empty where the method has
// none. start: "cold" or "warm". status: the estimate's, "stopped" (out of time), "not_available"
// or the code of the error. Without an estimate the cells of errors are empty.
inline constexpr const char* kErrorTimeHeading =
    "mesh,nodes,scenario,method,prior,rank,start,repetition,time_ms,time_over_tsolve,cross_mm,"
    "field_mean_mm,field_max_mm,recovery_pct,active,iterations,status,coverage_90,t_solve_ms";

// Times each repetition of the condensed method and writes a row for it. An update keeps nothing
// but memory of the one before; so rows "cold" and, of a second round, rows "warm" are the same
// estimate.
Status run_condensed(const Head& head, const Trial& trial, int rank, CsvWriter& out);
// The same for the other methods, all cold. Ends early when budget_s is used up; a
// repetition that goes beyond is stopped.
Status run_method(const Head& head, const Trial& trial, Method method, const Prior& prior,
                  int repetitions, double budget_s, CsvWriter& out);

}  // namespace brainshift::bench
