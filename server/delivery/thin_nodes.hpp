// SPDX-License-Identifier: GPL-3.0-or-later
// Nodes at least a spacing apart, with one of them near every other: a maximal Poisson-disk sample,
// taken greedily in the order of the nodes, those of the boundary first.
//
//   |x_a - x_b| >= spacing for chosen nodes a, b
//   every candidate has a chosen node nearer than the spacing; one of the boundary has a chosen one
//   of the boundary
#pragma once

#include <vector>

#include "common/core/types.hpp"

namespace brainshift::server {

// candidates: ascending. on_boundary: one entry per node. spacing_mm > 0. Ascending; the same
// for the same input on every machine.
std::vector<NodeIndex> thin_nodes(const Points& nodes, const std::vector<NodeIndex>& candidates,
                                  const std::vector<bool>& on_boundary, double spacing_mm);

}  // namespace brainshift::server
