// SPDX-License-Identifier: GPL-3.0-or-later
// OutsideTaper: how a brain's displacement ends outside of the brain.
//
// At distance d (mm) from the brain the field is u(closest point of the brain's surface) times
//
//   1                                                   d <= full_mm
//   (1 + cos(pi (d - full_mm) / (zero_mm - full_mm))) / 2   in between
//   0                                                   d >= zero_mm
//
// No model says what skull, cerebrospinal fluid and skin do: the taper is there so that an image
// is not torn at the brain's surface. Meshes are a voxel or two off the visible surface; the first
// 5 mm therefore move as the surface does. At 20 mm lies the skin. Its steepest slope is
// pi / 2 / 15 mm, so that shifts below 9.5 mm fold nothing.
#pragma once

#include "common/core/error.hpp"

namespace brainshift::client {

struct OutsideTaper {
  double full_mm = 5.0;
  double zero_mm = 20.0;

  // Precondition: validate(taper). distance_mm >= 0; 0 inside the brain.
  double factor(double distance_mm) const;
};

// kInvalidArgument: must be 0 <= full_mm < zero_mm <= 1000.
Status validate(const OutsideTaper& taper);

}  // namespace brainshift::client
