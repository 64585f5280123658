// SPDX-License-Identifier: GPL-3.0-or-later
// What the programs that play many surgeries have in common: the head of a case file, options of a
// table that can be resumed, and how the program ends.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <functional>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"

namespace brainshift::surgeries {

struct StudyArguments {
  std::uint64_t first_seed = 1;
  double thousand_nodes = 18.0;  // of the mesh; 18: the case's own edge length
  std::filesystem::path out = "rows.csv";
  bool resume = false;
};
// --first-seed, --thousand-nodes, --out, --resume.
void add_study_options(CLI::App& app, StudyArguments& arguments);

// A case file with its images. Those that it names and that are not there are looked for below
// $BRAINSHIFT_EXTERNAL_DATA, by their path relative to the case file. Errors of read_case_config.
Result<CaseConfig> read_head(const std::filesystem::path& path);

// Parses the options, then runs. BLAS is single-threaded: the study's own threads share the work.
// -> the exit status of core/exit_status.hpp. Failures go to stderr, one line.
int run_study(CLI::App& app, int argc, char** argv, const std::function<Status()>& run);

}  // namespace brainshift::surgeries
