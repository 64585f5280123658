// SPDX-License-Identifier: GPL-3.0-or-later
// Load modes of the prior: a few nodal force fields for what is physically uncertain about the
// loads, each times the standard deviation that the case gives it.
//
//   gravity   for each fluid level of the case the buoyancy of a fluid plane at that level: along
//             gravity (drainage is unknown) and along the two directions across it (pose is
//             unknown); three columns (along, across, across) per level
//   swelling  tissue that changes its volume by the strain theta around the tumour's centre c
//             (fem/swelling.hpp); four columns for each radius s of the case, r = |x - c|:
//               theta = exp(-r^2 / 2 s^2)
//               theta = (x_i - c_i) / s exp(1/2 - r^2 / 2 s^2), i = 1, 2, 3, for a centre that is
//                       not c; the largest value is 1 too
// The standard deviation of swelling is shared by the radii, so that theta(c) as a whole has it.
#pragma once

#include "common/values/brain_model.hpp"
#include "common/values/case_config.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::prior {

struct LoadModeCounts {
  int gravity = 0;
  int swelling = 0;
  int all() const { return gravity + swelling; }
};
LoadModeCounts load_mode_counts(const PriorConfig& config);

// 3n x all(), N: gravity, then swelling.
Eigen::MatrixXd load_modes(const BrainModel& model, const CaseConfig& config);

// The part of the prior that column `column` of the load modes belongs to. Columns after the load
// modes belong to kOther.
PriorPart prior_part(int column, const LoadModeCounts& counts);

}  // namespace brainshift::prior
