// SPDX-License-Identifier: GPL-3.0-or-later
// One linear solve without contact, for sweeps of mesh, material and support.
#pragma once

#include "common/fem/dof_map.hpp"
#include "tests/stability/reference.hpp"
#include "tests/stability/stability_point.hpp"

namespace brainshift::stability {

struct LinearBody {
  TetMesh mesh;
  std::vector<fem::Elasticity> materials;  // one, or one per tetrahedron
  fem::DofMap dofs{0};
  // Springs that hold single nodes: node and stiffness, N/mm.
  std::vector<std::pair<NodeIndex, double>> springs;
};

// A block of 60 mm standing on a fixed floor, cells^3; brain.
LinearBody standing_block(int cells);

// Its own weight on its side, scaled until the body moves by 5 mm; solved and compared with the same in long double.
// Bound: rounding_bound(). The mesh is checked as it is when a case is read.
void solve_linear(const LinearBody& body, Point point, const Options& options);

}  // namespace brainshift::stability
