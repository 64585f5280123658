// SPDX-License-Identifier: GPL-3.0-or-later
// A few nodes spread over the mesh, and interpolation from them to every node; for fields that vary
// slowly, such as a standard deviation.
#pragma once

#include <vector>

#include "common/core/types.hpp"

namespace brainshift::geometry {

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
