// SPDX-License-Identifier: GPL-3.0-or-later
// What a topic of the suite is run with. A topic is one function of one source; it measures, and
// tells a Tally. It throws std::runtime_error when it cannot go on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/core/error.hpp"
#include "tests/faults/tally.hpp"

namespace brainshift::faults {

struct Settings {
  std::filesystem::path work;         // raw CSV, journals, logs; exists
  std::filesystem::path model;        // that the daemon serves
  std::filesystem::path other_model;  // of another patient; topic restart
  std::filesystem::path surgery;      // simulated with `model`'s case: what is sent
  int count = 0;                      // of what the topic repeats
  double seconds = 0.0;               // for topics that last
  std::uint32_t seed = 1;
};

// The value of a Result, or an exception that ends the topic with the error's sentence.
template <typename T>
T need(Result<T> result, const std::string& what) {
  if (!result) throw std::runtime_error(what + ": " + result.error().message);
  return *std::move(result);
}

inline void need(const Status& status, const std::string& what) {
  if (!status) throw std::runtime_error(what + ": " + status.error().message);
}

void run_kills(const Settings& settings, Tally& tally);
void run_damaged_files(const Settings& settings, Tally& tally);
void run_bad_messages(const Settings& settings, Tally& tally);
void run_unfinished_messages(const Settings& settings, Tally& tally);
void run_stalled_viewer(const Settings& settings, Tally& tally);
void run_many_viewers(const Settings& settings, Tally& tally);
void run_sixty_hertz(const Settings& settings, Tally& tally);
void run_half_open(const Settings& settings, Tally& tally);
void run_crowds(const Settings& settings, Tally& tally);
void run_restart(const Settings& settings, Tally& tally);
void run_clocks(const Settings& settings, Tally& tally);
void run_cost(const Settings& settings, Tally& tally);
void run_hang_ups(const Settings& settings, Tally& tally);
void run_choices(const Settings& settings, Tally& tally);
void run_largest(const Settings& settings, Tally& tally);
void run_allocations(const Settings& settings, Tally& tally);
void run_hardware_threads(const Settings& settings, Tally& tally);

}  // namespace brainshift::faults
