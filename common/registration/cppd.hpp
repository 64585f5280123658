// SPDX-License-Identifier: GPL-3.0-or-later
// Closest point projection distance (paper 2.7): from nodes to a measured parenchymal surface, signed:
// negative when the node lies on the outward side of the surface, positive when on the inner side.
//   |d_i| = |q_i - x_i|,   d_i > 0 when (q_i - x_i) . n(q_i) > 0,   q_i closest surface point to node x_i
// n is the outward pseudo-normal, which gives the right sign at edges and vertices too. A node beside an open
// surface is measured to its rim; select the nodes that face the surface.
#pragma once

#include "common/core/error.hpp"
#include "common/core/statistics.hpp"
#include "common/core/types.hpp"
#include "common/geometry/closest_point.hpp"

namespace brainshift::registration {

// nodes: 3 x n. Returns n signed distances, mm ("positive/negative when the vector from the projection to
// the node is opposite/along the outward surface normal").
VecX signed_projection_distance(const Points& nodes, const geometry::ClosestPointIndex& surface);

// Mean and standard deviation of |d_i|.
MeanStd mismatch(const VecX& signed_distances);

}  // namespace brainshift::registration
