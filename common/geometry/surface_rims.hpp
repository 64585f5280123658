// SPDX-License-Identifier: GPL-3.0-or-later
// Edges of a triangle surface: shared edges, the rims of holes, the parts connected by edges.
#pragma once

#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::geometry {

struct SurfaceRims {
  int parts = 0;                 // components of triangles connected by edges
  std::vector<int> part_of_rim;  // per closed rim
  std::vector<double> rim_mm;    // its length
};

// kDegenerateMesh: a triangle with a repeated or unknown vertex, an edge of more than two
// triangles, or an edge that two triangles pass in the same direction. The sentence names the
// triangles or the vertices.
Result<SurfaceRims> surface_rims(const TriangleSurface& surface);

}  // namespace brainshift::geometry
