// SPDX-License-Identifier: GPL-3.0-or-later
// Drained linear elasticity on linear (P1) tetrahedra.
//
//   -div sigma(u) = f,   sigma = lambda tr(e) I + 2 G e,   e = sym grad u     (paper eq. 1, p = 0)
//
// with lambda = 2 G nu / (1 - 2 nu). Element stiffness between local nodes i, j with
// shape-function gradients g_i (constant in the element), V its volume:
//
//   K_ij = V [ lambda g_i g_j^T + G g_j g_i^T + G (g_i . g_j) I ]                  3 x 3, N/mm
//
// Drained: update intervals are much longer than the consolidation time (about 2 s for a head
// with Table 1), so pore pressure has vanished. P1 locks towards nu = 0.5; keep nu <= 0.48.
#pragma once

#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/fem/dof_map.hpp"
#include "common/linalg/symmetric_matrix.hpp"

namespace brainshift::fem {

// Above this value P1 tetrahedra lock: on a head they are too stiff by more than one percent
// (about 26 % at 0.499), whatever the solver.
inline constexpr double kLockingPoissonRatio = 0.48;

struct Elasticity {
  double lambda = 0.0;  // N/mm^2
  double shear = 0.0;   // G, N/mm^2
};
// From Table 1's G (Pa) and nu.
Elasticity elasticity_from(const Material& material);

// Columns: gradients of the four shape functions, 1/mm; volume in mm^3.
struct TetGeometry {
  Eigen::Matrix<double, 3, 4> gradients;
  double volume = 0.0;
};
TetGeometry tet_geometry(const TetMesh& mesh, int tet);

// Lower triangle (diagonal included) of T^T K T in the unknowns of `dofs`, compressed, sorted;
// N/mm. One material for the whole mesh, or one per tetrahedron.
linalg::SymmetricMatrix assemble_stiffness(const TetMesh& mesh, const Elasticity& material,
                                           const DofMap& dofs);
linalg::SymmetricMatrix assemble_stiffness(const TetMesh& mesh,
                                           const std::vector<Elasticity>& of_tet,
                                           const DofMap& dofs);

// Adds a symmetric 3 x 3 block (RAS axes) to the diagonal block of `node`. Precondition: the node
// has the identity frame and no constraint, as slaves do.
void add_to_node_block(linalg::SymmetricMatrix& lower, const DofMap& dofs, NodeIndex node,
                       const Mat3& block);

// Volume of each node, mm^3: a quarter of every adjacent tetrahedron. Sums to the mesh volume.
VecX nodal_volumes(const TetMesh& mesh);

}  // namespace brainshift::fem
