// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/block_solver.hpp"

#include "common/fem/stiffness_factor.hpp"

namespace brainshift::fem {

BlockSolver::BlockSolver(const linalg::SymmetricMatrix& stiffness, const StiffnessFactor& factor,
                         const DofMap& dofs)
    : stiffness_(stiffness), norm_(linalg::max_norm(stiffness)), factor_(factor), dofs_(dofs) {}

Status BlockSolver::solve(const Eigen::MatrixXd& loads, Eigen::MatrixXd& displacements) {
  dofs_.restrict_rows(loads, rhs_);
  factor_.solve_rows(rhs_, unknowns_, workspace_);
  const auto checked = check_rows(stiffness_, norm_, factor_, rhs_, unknowns_, workspace_);
  if (!checked) return tl::unexpected(checked.error());
  dofs_.expand_rows(unknowns_, displacements);
  return {};
}

}  // namespace brainshift::fem
