// SPDX-License-Identifier: GPL-3.0-or-later
// What one `make bench` wrote to its folder. Its figures, tables and checks have no other source.
//
//   machine.txt                      bench_summary --machine: where it ran, and the commit
//   meshes-*.csv, error_time-*.csv   bench_error_time
//   run-NAME.json, latency-NAME.csv  `brainshift replay` of the surgery NAME; with another BLAS
//                                    kernel NAME@KERNEL
//   stages.csv                       bench_update: where the time of an update goes
//   scenes.csv                       bench_scenes: what leaving out parts saves and costs
//   facts.csv                        name,value: what the script measured itself
//   left_out.csv                     what the script did not run, a line each
//   prepare.json                     `brainshiftd prepare --json`
//   prepare-100k.json                the same with edges for 100 thousand nodes
//   direct-NAME.json                 bench_exactness --scenario NAME
#pragma once

#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/replay/run_report.hpp"
#include "common/core/error.hpp"
#include "tests/benchmarks/csv_table.hpp"
#include "tests/benchmarks/paired_test.hpp"

namespace brainshift::bench {

// Repetitions of one method on one mesh and scenario, taken together.
struct MethodSummary {
  std::string mesh, scenario, method, prior, start;
  int rank = 0;  // 0: not applicable
  int repetitions = 0;
  double p50_ms = 0.0;       // of those that gave an estimate; NaN for none
  double max_ms = 0.0;       // of all
  double over_tsolve = 0.0;  // median of time / t_solve
  double active = 0.0;       // mean, as iterations
  double iterations = 0.0;
  // Means over the repetitions that all methods of this mesh and
  // scenario have; compared: their number.
  int compared = 0;
  double cross_mm = 0.0;
  double field_mean_mm = 0.0;
  double field_max_mm = 0.0;
  double coverage_90 = 0.0;
  double own_coverage_90 = 0.0;  // over all repetitions of this method
  std::string status;            // the one of all repetitions, or "N of M converged"
};

struct Results {
  CsvTable meshes;
  CsvTable error_time;
  std::vector<MethodSummary> methods;  // in the order of error_time
  CsvTable stages;
  CsvTable scenes;
  std::map<std::string, client::RunReport> runs;          // by NAME
  std::map<std::string, std::vector<double>> latency_ms;  // by NAME, without the first update
  std::map<std::string, double> facts;
  std::vector<std::string> left_out;
  std::string machine;  // machine.txt

  // NaN when there is none.
  double fact(const std::string& name) const;
  const MethodSummary* find(const std::string& mesh, const std::string& scenario,
                            const std::string& method, const std::string& start,
                            int rank = kLargestRank, const std::string& prior = "case") const;
  // The first updates of all sessions cold-N (with `suffix` "@KERNEL" or ""), each over the solve
  // of its session, and the least number of active slaves.
  struct FirstUpdates {
    std::vector<double> over_tsolve;
    int active = 0;
  };
  FirstUpdates first_updates(const std::string& suffix) const;
  static constexpr int kLargestRank = -1;
};

std::vector<MethodSummary> summarise(const CsvTable& error_time);

// Errors of two methods on the surgeries that both of them have inverted: second - first.
struct PairedErrors {
  PairedTest tumour, field;  // mm; of cross_mm and field_mean_mm
};
PairedErrors paired_errors(const CsvTable& error_time, const MethodSummary& first,
                           const MethodSummary& second);

// Missing parts stay empty; kUnreadable for a part that exists and is not what its name says.
Result<Results> read_results(const std::filesystem::path& folder);

}  // namespace brainshift::bench
