// SPDX-License-Identifier: GPL-3.0-or-later
// Choices among a mesh's nodes: those of a viewer's region, and a few that are spread over it.
#pragma once

#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/session_state.hpp"

namespace brainshift::geometry {

// The nodes of a model that lie in a viewer's region (values/session_state.hpp). The daemon's
// choice and the bridge's grid are of the same nodes, because both ask here.

// Of every node from the tumour's surface, mm; negative inside. Empty when the model has no tumour.
// Some tenths of a second on a head.
std::vector<double> distances_from_tumour(const BrainModel& model);

// Ascending. tumour_distance_mm: of distances_from_tumour(); needed for a region about the tumour
// alone. kEmptySet: no tumour, or no node; the sentence names the region.
Result<std::vector<NodeIndex>> nodes_in_region(const BrainModel& model, const Region& region,
                                               const std::vector<double>& tumour_distance_mm);

// A few nodes spread over the mesh, and interpolation from them to every node; for fields that vary
// slowly, such as a standard deviation.

// `count` nodes (all, if there are fewer), each the farthest from those before it, beginning with
// node 0: every leading part of the list is spread over the mesh too. nodes: 3 x n, mm.
std::vector<NodeIndex> spread_nodes(const Points& nodes, int count);

// Interpolation by inverse squared distance to the four nearest sources (Shepard 1968).
struct Interpolation {
  Eigen::Matrix<int, 4, Eigen::Dynamic> neighbours;  // 4 x n, index into sources
  Eigen::Matrix<float, 4, Eigen::Dynamic> weights;   // 4 x n, sum 1
};
// sources: 3 x c, c >= 1; targets: 3 x n.
Interpolation interpolate(const Points& sources, const Points& targets);

}  // namespace brainshift::geometry
