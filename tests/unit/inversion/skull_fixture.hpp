// SPDX-License-Identifier: GPL-3.0-or-later
// A skull without a brain: slaves on a line that press on each other.
#pragma once

#include <cmath>
#include <cstdint>

#include "common/contact/penalty.hpp"
#include "common/core/random.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

inline constexpr int kSlaves = 120, kModes = 12;
inline constexpr double kBeta = 5.0;
inline constexpr ModeWindow kWindow{0, kModes};

// Slaves on a line with a smooth compliance, pressed by random loads: badly conditioned, as a skull
// is.
inline CondensedOperators skull_operators(double gap_mm) {
  Random random(5);
  CondensedOperators result;
  result.compliance.resize(kSlaves, kSlaves);
  for (int i = 0; i < kSlaves; ++i) {
    for (int j = 0; j < kSlaves; ++j) {
      result.compliance(i, j) = 2.0 * std::exp(-std::abs(i - j) / 3.0);
    }
    result.slaves.push_back(i);
  }
  result.slave_modes.resize(kSlaves, kModes);
  for (Eigen::Index i = 0; i < result.slave_modes.size(); ++i) {
    result.slave_modes.data()[i] = random.normal() - 0.5;
  }
  result.initial_penetration_mm = VecX::Constant(kSlaves, -gap_mm);
  return result;
}

inline VecX skull_loads(std::uint64_t seed, double size) {
  Random random(seed);
  VecX z(kModes);
  for (double& value : z) value = size * random.normal();
  return z;
}

inline contact::ActiveSet random_set(Random& random, double share) {
  contact::ActiveSet set(kSlaves);
  for (char& one : set) one = random.uniform() < share ? 1 : 0;
  return set;
}

}  // namespace brainshift::inversion
