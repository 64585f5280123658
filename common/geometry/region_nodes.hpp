// SPDX-License-Identifier: GPL-3.0-or-later
// The nodes of a model that lie in a viewer's region (values/session_state.hpp). The daemon's
// choice and the bridge's grid are of the same nodes, because both ask here.
#pragma once

#include <vector>

#include "common/core/error.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/session_state.hpp"

namespace brainshift::geometry {

// Of every node from the tumour's surface, mm; negative inside. Empty when the model has no tumour.
// Some tenths of a second on a head.
std::vector<double> distances_from_tumour(const BrainModel& model);

// Ascending. tumour_distance_mm: of distances_from_tumour(); needed for a region about the tumour
// alone. kEmptySet: no tumour, or no node; the sentence names the region.
Result<std::vector<NodeIndex>> nodes_in_region(const BrainModel& model, const Region& region,
                                               const std::vector<double>& tumour_distance_mm);

}  // namespace brainshift::geometry
