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

// From 3 x 3 blocks of element node pairs to the lower triangle of T^T K T. All elements share
// it; private to fem.

// Zero matrix with the pattern of the assembled lower triangle: the nodes of an element are
// coupled pairwise. elements: nodes per element x m.
linalg::SymmetricMatrix lower_pattern(const Eigen::Ref<const Eigen::MatrixXi>& elements,
                                      const DofMap& dofs);

// Adds the 3 x 3 block (RAS axes) of the node pair (row node, column node) to the lower triangle.
// Skips entries above the diagonal and those of constrained unknowns. Precondition: some element
// holds both nodes.
void add_block(linalg::SymmetricMatrix& lower, const DofMap& dofs, NodeIndex row_node,
               NodeIndex column_node, Mat3 block);

// Assembles element by element. element_blocks(e) returns a function of two local nodes that
// gives their block in RAS axes. Only blocks on and below the diagonal (by global node) are
// requested.
template <typename ElementBlocks>
linalg::SymmetricMatrix assemble_lower(const Eigen::Ref<const Eigen::MatrixXi>& elements,
                                       const DofMap& dofs, const ElementBlocks& element_blocks) {
  linalg::SymmetricMatrix lower = lower_pattern(elements, dofs);
  for (Eigen::Index e = 0; e < elements.cols(); ++e) {
    const auto block = element_blocks(static_cast<int>(e));
    for (int i = 0; i < elements.rows(); ++i) {
      for (int j = 0; j < elements.rows(); ++j) {
        const int row_node = elements(i, e);
        const int column_node = elements(j, e);
        if (row_node < column_node) continue;
        add_block(lower, dofs, row_node, column_node, block(i, j));
      }
    }
  }
  return lower;
}

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

// Materials of a body of several tissues: one PoroMaterial per region, one region per
// tetrahedron.
//
//   -div(sigma(u) - alpha p I) = f,   d/dt(alpha div u + S p) - div(k grad p) = 0  (paper eq. 1-2)
//
// Drained elasticity uses `elastic` alone.
struct PoroMaterial {
  Elasticity elastic;             // drained, N/mm^2
  double biot_coefficient = 1.0;  // alpha, 0 to 1
  double storage = 0.0;           // S: the paper's 1/S, mm^2/N; 0: incompressible constituents
  double permeability = 0.0;      // k: hydraulic conductivity over unit weight, mm^4/(N s)
};

// The material of a case, in internal units.
PoroMaterial poro_material_from(const Material& material);

// of_tet: one index into `materials` per tetrahedron.
struct MaterialMap {
  std::vector<PoroMaterial> materials;
  std::vector<int> of_tet;

  static MaterialMap uniform(const PoroMaterial& material, int num_tets) {
    return {{material}, std::vector<int>(static_cast<std::size_t>(num_tets), 0)};
  }
  const PoroMaterial& at(int tet) const {
    return materials[static_cast<std::size_t>(of_tet[static_cast<std::size_t>(tet)])];
  }
  // The elastic part alone, one per tetrahedron.
  std::vector<Elasticity> elastic() const {
    std::vector<Elasticity> all;
    all.reserve(of_tet.size());
    for (const int index : of_tet)
      all.push_back(materials[static_cast<std::size_t>(index)].elastic);
    return all;
  }
};

}  // namespace brainshift::fem
