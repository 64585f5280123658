// SPDX-License-Identifier: GPL-3.0-or-later
// Load modes of the prior: few nodal force fields for what is physically uncertain about the loads.
//
//   gravity   buoyancy of a fluid plane at each level of the case, along gravity (what drainage leaves open) and along
//             the two directions across it (what pose leaves open): triples (along, across, across)
//   swelling  tissue that changes its volume by theta around the tumour's centre c (fem/swelling.hpp), for each radius s
//             of the case: theta = exp(-r^2 / 2 s^2), and for a centre that is not c the three fields
//             theta = (x_i - c_i) / s exp(1/2 - r^2 / 2 s^2), whose largest value is 1 too: fours
// times the case's standard deviations; that of swelling is shared by the radii, so that theta(c) has it.
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

// The part that a column of the load modes belongs to, and every column after them.
PriorPart prior_part(int column, const LoadModeCounts& counts);

}  // namespace brainshift::prior
