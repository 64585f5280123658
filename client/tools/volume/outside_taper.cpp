// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/volume/outside_taper.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace brainshift::client {

double OutsideTaper::factor(double distance_mm) const {
  if (distance_mm <= full_mm) return 1.0;
  if (distance_mm >= zero_mm) return 0.0;
  const double part = (distance_mm - full_mm) / (zero_mm - full_mm);
  return 0.5 * (1.0 + std::cos(std::numbers::pi * part));
}

Status validate(const OutsideTaper& taper) {
  constexpr double kFarthest_mm = 1000.0;
  const bool ok =
      taper.full_mm >= 0.0 && taper.full_mm < taper.zero_mm && taper.zero_mm <= kFarthest_mm;
  if (ok) return {};
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("taper outside the brain: full up to {} mm, zero from {} mm: must be 0 "
                          "<= full < zero <= {}",
                          taper.full_mm, taper.zero_mm, kFarthest_mm));
}

}  // namespace brainshift::client
