// SPDX-License-Identifier: GPL-3.0-or-later
// Gross errors in a part of the points: up to 20 mm in any direction for boundary points, up to
// 10 mm for displacements (data_check.hpp rejects data whose neighbours differ by more than 15 mm).
#pragma once

#include "common/core/random.hpp"
#include "common/values/observation.hpp"

namespace brainshift::test_support {

inline constexpr double kMinGrossError_mm = 5.0;
inline constexpr double kMaxOfPoints_mm = 20.0, kMaxOfDisplacements_mm = 10.0;

// `fraction` of the boundary points or landmark pairs are off; other observations stay as they are.
Observation with_gross_errors(Observation observation, double fraction, Random& random);

}  // namespace brainshift::test_support
