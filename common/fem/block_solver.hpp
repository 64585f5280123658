// SPDX-License-Identifier: GPL-3.0-or-later
// BlockSolver: K^-1 of several nodal load columns at once; one per thread, sharing the factor.
#pragma once

#include "common/fem/dof_map.hpp"
#include "common/fem/stiffness_factor.hpp"

namespace brainshift::fem {

class BlockSolver {
 public:
  // Keeps references to both.
  BlockSolver(const StiffnessFactor& factor, const DofMap& dofs);

  // U = T K^-1 T^T F; columns are nodal vectors, node-major, 3n rows; F in N, U in mm.
  void solve(const Eigen::MatrixXd& loads, Eigen::MatrixXd& displacements);

 private:
  const StiffnessFactor& factor_;
  const DofMap& dofs_;
  StiffnessFactor::Workspace workspace_;
  Eigen::MatrixXd rhs_, unknowns_;
  Points nodal_;
  VecX column_;
};

}  // namespace brainshift::fem
