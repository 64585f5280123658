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
  kReach,       // how far a step may go before contact changes in many slaves
  kHypotheses,  // hypotheses about the prior's strengths, their mean and covariance
  kFollow,      // places and weights of data for the present estimate
  kDeviation,   // standard deviation of every node, and what is known of it
  kField,       // displacement of every node
  kCheck,       // the field's equilibrium and deformation, agreement of the sources, omissions
};
inline constexpr std::size_t kUpdateStages = 12;

constexpr const char* to_string(UpdateStage stage) {
  constexpr std::array<const char*, kUpdateStages> kNames = {
      "locate", "sample",     "contact", "gradient",  "linearise", "minimise",
      "reach",  "hypotheses", "follow",  "deviation", "field",     "check"};
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
