// SPDX-License-Identifier: GPL-3.0-or-later
// The sheets of falx and tentorium in a mesh that is open there: which nodes lie on which side.
#pragma once

#include <vector>

#include "common/core/types.hpp"
#include "common/fem/displacement_space.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

struct SheetNode {
  NodeIndex node;
  Vec3 normal;  // unit, out of the tissue of the node's side: area-weighted over its facets
};
// Vertices and, of quadratic elements, middles of edges, by increasing node. Nodes of the free edge
// are left out: both sides share them, and the areas of both cancel. The space is of the mesh that
// the sheets belong to.
std::vector<SheetNode> sheet_nodes(const Septa& septa, const fem::DisplacementSpace& space);

// The nodes of the model, 3 x n, mm; those on a sheet are moved by kIntoSide_mm into the tissue of
// their side. So the same place of another mesh, whose sheets lie elsewhere by a part of an edge,
// is on the same side.
inline constexpr double kIntoSide_mm = 3.0;
Points nodes_in_their_sides(const BrainModel& model);

}  // namespace brainshift::client
