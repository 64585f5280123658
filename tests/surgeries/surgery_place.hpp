// SPDX-License-Identifier: GPL-3.0-or-later
// All surgeries of one prepared head: for each seed and scenario the truth, the daemon's pipeline
// over its observations, and a row per update.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/benchmarks/bench_head.hpp"
#include "tests/surgeries/surgery_rows.hpp"

namespace brainshift::surgeries {

struct PlacePlan {
  std::string head;  // case_id of the case file
  int place = 1;
  std::uint64_t patient_seed = 1;
  std::vector<std::uint64_t> seeds;     // of variation, stiffness and noise
  std::vector<std::string> scenarios;   // names that client::find_scenario knows
  std::vector<std::string> kinds = {};  // of truths from outside: outside::find_kind
};

// Called after each surgery with its key, the row of its last update and how long it took.
using Told = std::function<void(const SurgeryKey&, const Row& last, double seconds)>;

// Surgeries that `rows` has are skipped; the others are appended. A refused update is a row, not an
// error; so is a scenario that does nothing on this place (client/tools/twin/truth_load.hpp) and a
// kind that finds no equilibrium. Kinds are seen by the instruments of the scenario kSeenBy.
// Errors: of the twin, of building an inverter, of scoring, of writing.
Status play_place(const bench::Head& head, const PlacePlan& plan, RowFile& rows, const Told& told);

inline constexpr const char* kSeenBy = "joint-sag";

}  // namespace brainshift::surgeries
