// SPDX-License-Identifier: GPL-3.0-or-later
// Figures of `make bench`, drawn from what its folder holds.
#pragma once

#include <filesystem>
#include <vector>

#include "common/core/error.hpp"
#include "tests/benchmarks/bench_results.hpp"

namespace brainshift::bench {

//   error_time-MESH-SCENARIO.png  errors against run time with the Pareto front
//   latency.png                   share of updates that take longer, for every scenario
//   growth.png                    preparation, memory and update time against mesh size
// Figures without data are left out. Returns the files written; kWriteFailed.
Result<std::vector<std::filesystem::path>> draw_figures(const Results& results,
                                                        const std::filesystem::path& folder);

}  // namespace brainshift::bench
