// SPDX-License-Identifier: GPL-3.0-or-later
// BlockSolver: K^-1 applied to several nodal loads at once. One per thread; the threads
// share the factor.
#pragma once

#include "common/core/error.hpp"
#include "common/fem/dof_map.hpp"
#include "common/fem/stiffness_factor.hpp"

namespace brainshift::fem {

class BlockSolver {
 public:
  // Keeps references to all three. stiffness: the matrix of the factor.
  BlockSolver(const linalg::SymmetricMatrix& stiffness, const StiffnessFactor& factor,
              const DofMap& dofs);

  // U = T K^-1 T^T F, transposed: a field per row, k x 3n, node-major. F in N, U in mm; both may be
  // the same matrix. Errors as check_rows.
  Status solve(const Eigen::MatrixXd& loads, Eigen::MatrixXd& displacements);

 private:
  const linalg::SymmetricMatrix& stiffness_;
  double norm_;
  const StiffnessFactor& factor_;
  const DofMap& dofs_;
  StiffnessFactor::Workspace workspace_;
  Eigen::MatrixXd rhs_, unknowns_;
};

}  // namespace brainshift::fem
