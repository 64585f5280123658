// SPDX-License-Identifier: GPL-3.0-or-later
// Signed distance to a closed surface at the nodes of a grid, from the surface's closest-point
// index.
//
// Within three spacings of the surface every node is measured against all triangles near it,
// exact but for single precision. A farther node takes over the closest triangle of a neighbour
// (vector distance transform, Danielsson 1980) and then walks over adjacent triangles as long as
// the distance falls. The result is the distance to some point of the surface, so it is never too
// small; in all measurements it was too large by less than 0.03 spacings.
// The sign is that of the pseudo-normal at the closest point (Baerentzen & Aanaes 2005), passed
// on outwards from node to node.
//
// The same surface gives the same bits, whatever the number of threads.
#pragma once

#include "common/core/error.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/values/distance_grid.hpp"

namespace brainshift::geometry {

struct DistanceGridOptions {
  // Trilinear interpolation of the distance to a smooth surface errs by up to h^2 / (4 R), with R
  // its radius of curvature and h the spacing: 0.006 mm for h = 0.5 mm and R = 10 mm.
  double spacing_mm = 0.5;
  // The grid reaches this far beyond the surface's bounding box.
  double margin_mm = 12.0;
  // Limit on the number of nodes, 4 bytes each. The spacing grows until the grid keeps to it.
  double max_nodes = 4e6;
  int threads = 0;  // 0: as many as the machine has cores
};

// kInvalidArgument: surface not closed, or an option out of range (named, with its value).
Result<DistanceGrid> signed_distance_grid(const ClosestPointIndex& surface,
                                          const DistanceGridOptions& options = {});

}  // namespace brainshift::geometry
