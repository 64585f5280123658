// SPDX-License-Identifier: GPL-3.0-or-later
// How far the tumour moved, as every display and report states it: "2.3 +- 0.2 mm".
#pragma once

#include <optional>
#include <vector>

#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::geometry {

// Nodes inside the tumour, ascending; none without a tumour.
std::vector<NodeIndex> tumour_nodes(const BrainModel& model);

struct TumourMotion {
  double mm = 0.0;  // mean length of the displacements of the tumour's nodes
  // Mean of their sd_mm: per component, taken for one error that all share. Without: not told.
  std::optional<double> sd_mm;
};
// Of the update's tumour nodes: those of its part, where it has one. nullopt: it has none.
std::optional<TumourMotion> tumour_motion(const Update& update,
                                          const std::vector<NodeIndex>& tumour);

}  // namespace brainshift::geometry
