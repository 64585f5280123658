// SPDX-License-Identifier: GPL-3.0-or-later
// The figures that `make bench` checks against a bound, and its summary.json and tables.md.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "tests/benchmarks/bench_results.hpp"

namespace brainshift::bench {

struct Check {
  std::string name;  // stable
  double value = 0.0;
  std::string bound;  // in words, with the unit
  bool pass = false;
  std::string command;  // measures the value
  // False: a figure that is only shown. It has no "pass" in summary.json.
  bool has_bound = true;
};

// A value that was not measured is NaN and does not pass. Times in units of t_solve are divided by
// full_solve_ms of the same report. `folder`: for the commands. What belongs to the mesh of 100
// thousand nodes is checked unless left_out.csv names that mesh.
std::vector<Check> checks(const Results& results, const std::string& folder);

// {"checks": [...], "left_out": [...]}; a value that is not finite is null.
std::string to_json(const std::vector<Check>& checks, const std::vector<std::string>& left_out);

// Markdown: machine and commit, checks, latencies, stages, scenes, meshes, methods.
std::string tables(const Results& results, const std::vector<Check>& checks);
// machine.txt: processor, cores, memory, BLAS kernel, commit.
std::string machine_line(const std::string& commit);

}  // namespace brainshift::bench
