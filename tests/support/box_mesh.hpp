// SPDX-License-Identifier: GPL-3.0-or-later
// Structured meshes with known geometry, for tests.
#pragma once

#include <functional>

#include "common/core/mesh.hpp"

namespace brainshift::test_support {

// Box [0, size] cut into nx x ny x nz cuboids of six tetrahedra each (Kuhn's subdivision). Node
// (i, j, k) has index i + (nx + 1) * (j + (ny + 1) * k).
TetMesh box_mesh(int nx, int ny, int nz, const Vec3& size);

// Box [low, high] cut into cells^3 cuboids in the same way. Interior nodes move by up to `jitter`
// (< 0.2) of the shortest cell edge, with a fixed seed: irregular inside, exact at the boundary.
TetMesh box_mesh(const Vec3& low, const Vec3& high, int cells, double jitter = 0.0);

// Moves every interior node by up to `amplitude` in each direction, with a fixed seed. Boundary
// nodes stay.
void perturb_interior(TetMesh& mesh, double amplitude, unsigned seed);

// Indices of nodes that satisfy a predicate.
std::vector<NodeIndex> nodes_where(const TetMesh& mesh,
                                   const std::function<bool(const Vec3&)>& holds);

}  // namespace brainshift::test_support
