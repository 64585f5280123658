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

// Its own weight on its side, scaled until the body moves by 5 mm; solved and compared with the
// same in long double. Bound: rounding_bound(). The mesh is checked as it is when a case is read.
//
// Faults: sign    one coupling inside the product's matrix has the other sign
//         normal  the force on one node is turned by 0.2 rad
//         scale   the product's matrix is 1 % too large
void solve_linear(const LinearBody& body, Point point, const Options& options);

// One coupling, entry (i, j) with i > j, changes its sign: of those that are at least 1e-3 of
// their diagonal, the least, so that the matrix stays positive definite.
void flip_one_sign(linalg::SymmetricMatrix& lower);
// One node's force, the largest, turned by 0.2 rad.
void turn_one_force(Points& load);
// Turned by 0.2 rad about an axis across it.
Vec3 turned(const Vec3& vector);

}  // namespace brainshift::stability
