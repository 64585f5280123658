// SPDX-License-Identifier: GPL-3.0-or-later
// An eighth of a ball or of a thick sphere, for closed forms with symmetry planes.
#pragma once

#include <vector>

#include "common/core/mesh.hpp"

namespace brainshift::test_support {

// The octant x, y, z >= 0 in shells. radii: increasing, mm; the first is 0 for a full ball.
// cells: edges along each quarter circle. The faces of the spheres are flat. Nodes of a symmetry
// plane have a coordinate that is exactly 0.
TetMesh octant_mesh(const std::vector<double>& radii, int cells);

}  // namespace brainshift::test_support
