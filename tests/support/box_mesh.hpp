// SPDX-License-Identifier: GPL-3.0-or-later
// Structured meshes with known geometry, for tests.
#pragma once

#include <functional>

#include "common/core/mesh.hpp"

namespace brainshift::test_support {

// Box [0, size] cut into cells x cells x cells cubes of six tetrahedra each (Kuhn's subdivision). Node (i, j, k)
// has index i + (nx + 1) * (j + (ny + 1) * k).
TetMesh box_mesh(int nx, int ny, int nz, const Vec3& size);

// Moves every interior node by up to `amplitude` in each direction, fixed seed; boundary nodes stay.
void perturb_interior(TetMesh& mesh, double amplitude, unsigned seed);

// Indices of nodes that satisfy a predicate.
std::vector<NodeIndex> nodes_where(const TetMesh& mesh,
                                   const std::function<bool(const Vec3&)>& holds);

}  // namespace brainshift::test_support
