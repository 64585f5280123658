// SPDX-License-Identifier: GPL-3.0-or-later
// What one `make bench` wrote to its folder. Its figures, tables and checks have no other source.
//
//   meshes-*.csv, error_time-*.csv   bench_error_time
//   NAME.json, latency-NAME.csv      `brainshift replay` of scenario NAME
//   facts.csv                        name,value: what the script measured itself
//   prepare.json                     `brainshiftd prepare --json`
//   direct-NAME.json                 bench_exactness --scenario NAME
#pragma once

#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/replay/run_report.hpp"
#include "common/core/error.hpp"
#include "tests/benchmarks/csv_table.hpp"

namespace brainshift::bench {

// Repetitions of one method on one mesh and scenario, taken together.
struct MethodSummary {
  std::string mesh, scenario, method, start;
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
  std::string status;  // the one of all repetitions, or "N of M converged"
};

struct Results {
  CsvTable meshes;
  CsvTable error_time;
  std::vector<MethodSummary> methods;                     // in the order of error_time
  std::map<std::string, client::RunReport> runs;          // by scenario
  std::map<std::string, std::vector<double>> latency_ms;  // by scenario, without the first update
  std::map<std::string, double> facts;

  // NaN when there is none.
  double fact(const std::string& name) const;
  const MethodSummary* find(const std::string& mesh, const std::string& scenario,
                            const std::string& method, const std::string& start,
                            int rank = kLargestRank) const;
  static constexpr int kLargestRank = -1;
};

std::vector<MethodSummary> summarise(const CsvTable& error_time);

// Mean errors at the tumour of two methods, over the measurements that both of them have inverted.
struct PairedErrors {
  int measurements = 0;
  double first_mm = 0.0, second_mm = 0.0;  // NaN without measurements
};
PairedErrors paired_errors(const CsvTable& error_time, const MethodSummary& first,
                           const MethodSummary& second);

// Missing parts stay empty; kUnreadable for a part that exists and is not what its name says.
Result<Results> read_results(const std::filesystem::path& folder);

}  // namespace brainshift::bench
