// SPDX-License-Identifier: GPL-3.0-or-later
// UpdateProfile: where the time of an update goes. Stages do not overlap: their sum is the update
// but for what takes no time worth a stage.
#pragma once

#include <array>
#include <cstddef>

#include "common/core/stopwatch.hpp"

namespace brainshift::inversion {

enum class UpdateStage {
  kLocate,      // elements that hold the data
  kSample,      // operators at the data
  kContact,     // contact forces for given loads
  kGradient,    // the objective and its gradient at given loads
  kLinearise,   // the linear model of a set of active slaves
  kMinimise,    // its minimum
  kHypotheses,  // hypotheses about the prior's strengths, their mean and covariance
  kFollow,      // places and weights of data for the present estimate
  kDeviation,   // standard deviation of every node
  kField,       // displacement of every node
};
inline constexpr std::size_t kUpdateStages = 10;

constexpr const char* to_string(UpdateStage stage) {
  constexpr std::array<const char*, kUpdateStages> kNames = {
      "locate",   "sample",     "contact", "gradient",  "linearise",
      "minimise", "hypotheses", "follow",  "deviation", "field"};
  return kNames[static_cast<std::size_t>(stage)];
}

struct UpdateProfile {
  struct Entry {
    double ms = 0.0;
    int times = 0;  // it began
  };
  std::array<Entry, kUpdateStages> stages{};

  const Entry& of(UpdateStage stage) const { return stages[static_cast<std::size_t>(stage)]; }
};

// Counts the time from its construction to its destruction for one stage.
class StageClock {
 public:
  StageClock(UpdateProfile& profile, UpdateStage stage)
      : entry_(profile.stages[static_cast<std::size_t>(stage)]) {}
  StageClock(const StageClock&) = delete;
  StageClock& operator=(const StageClock&) = delete;
  ~StageClock() {
    entry_.ms += watch_.milliseconds();
    ++entry_.times;
  }

 private:
  UpdateProfile::Entry& entry_;
  Stopwatch watch_;
};

}  // namespace brainshift::inversion
