// SPDX-License-Identifier: GPL-3.0-or-later
// The verdict on an estimate (common/values/quality.hpp), for every method: Inverter::update() asks
// for it once per estimate.
//
// Each flag follows from members of the estimate. What a method does not compute sets no flag:
// misfit_ratio, contact.decrement, contact.max_violation_mm and the volume ratios may be NaN for
// "not computed". A number that is infinite, or NaN elsewhere, sets kNotFinite. Motion beyond the
// skull is measured in two ways:
//
//   motion   max_i |u_i| over all nodes                       above kMostMotion_mm
//   depth    contact.max_penetration_mm, over the slaves      above kDeepestInSkull_mm
//
// An element that is inverted sets kInvertedElements and not kVolumeLost. min_nodal_volume_ratio
// judges a loss of volume.
#pragma once

#include "common/values/estimate.hpp"

namespace brainshift::inversion {

// Never kNotJudged. O(nodes), some microseconds for a head. Writes into the memory that `verdict`
// has, and allocates only where its reason has to grow.
void judge(const Estimate& estimate, QualityVerdict& verdict);

}  // namespace brainshift::inversion
