// SPDX-License-Identifier: GPL-3.0-or-later
// Closest point projection distance (paper 2.7) from nodes to a measured surface of the brain.
//
//   |d_i| = |q_i - x_i|,   d_i > 0 when (q_i - x_i) . n(q_i) > 0
//   q_i: closest surface point to node x_i;  n: outward pseudo-normal
//
// The sign is negative when node x_i lies on the outward side of the surface, positive on the
// inner side, as in the paper. The pseudo-normal gives the right sign at edges and vertices too.
// A node beside an open surface is measured to the surface's rim, so pass only nodes that face the
// surface.
#pragma once

#include "common/core/error.hpp"
#include "common/core/statistics.hpp"
#include "common/core/types.hpp"
#include "common/geometry/closest_point.hpp"

namespace brainshift::registration {

// nodes: 3 x n, finite, mm, in the surface's frame. Returns n signed distances, mm.
VecX signed_projection_distance(const Points& nodes, const geometry::ClosestPointIndex& surface);

// Mean and standard deviation of |d_i|, mm.
MeanStd mismatch(const VecX& signed_distances);

}  // namespace brainshift::registration
