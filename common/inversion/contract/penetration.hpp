// SPDX-License-Identifier: GPL-3.0-or-later
// How far slaves stand in the skull, in the numbers that an iteration record and an estimate carry.
#pragma once

#include "common/core/types.hpp"

namespace brainshift::inversion {

// A slave counts as penetrating when it is deeper than this: a hundredth of the 1 mm gap. Penalty
// contact leaves force / beta, some micrometres, at every slave that carries a force.
inline constexpr double kPenetrationTolerance_mm = 0.01;

struct PenetrationSummary {
  int penetrating = 0;  // slaves above the tolerance
  double max_mm = 0.0;  // 0 when no slave penetrates
};

// penetration: one per slave, mm, negative where the slave is open.
inline PenetrationSummary summarise_penetration(const VecX& penetration) {
  PenetrationSummary summary;
  for (const double depth_mm : penetration) {
    if (depth_mm > kPenetrationTolerance_mm) ++summary.penetrating;
    if (depth_mm > summary.max_mm) summary.max_mm = depth_mm;
  }
  return summary;
}

}  // namespace brainshift::inversion
