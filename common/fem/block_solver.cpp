// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/block_solver.hpp"

#include "common/fem/stiffness_factor.hpp"

namespace brainshift::fem {

BlockSolver::BlockSolver(const linalg::SymmetricMatrix& stiffness, const StiffnessFactor& factor,
                         const DofMap& dofs)
    : stiffness_(stiffness), norm_(linalg::max_norm(stiffness)), factor_(factor), dofs_(dofs) {}

Status BlockSolver::solve(const Eigen::MatrixXd& loads, Eigen::MatrixXd& displacements) {
  rhs_.resize(dofs_.num_unknowns(), loads.cols());
  for (Eigen::Index j = 0; j < loads.cols(); ++j) {
    dofs_.restrict_into(Eigen::Map<const Points>(loads.col(j).data(), 3, dofs_.num_nodes()),
                        rhs_.col(j));
  }
  factor_.solve_many(rhs_, unknowns_, workspace_);
  const auto checked = check_many(stiffness_, norm_, factor_, rhs_, unknowns_, workspace_);
  if (!checked) return tl::unexpected(checked.error());
  displacements.resize(loads.rows(), loads.cols());
  for (Eigen::Index j = 0; j < loads.cols(); ++j) {
    dofs_.expand_into(unknowns_.col(j),
                      Eigen::Map<Points>(displacements.col(j).data(), 3, dofs_.num_nodes()));
  }
  return {};
}

}  // namespace brainshift::fem
