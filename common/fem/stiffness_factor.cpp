// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/stiffness_factor.hpp"

namespace brainshift::fem {

Result<linalg::SolveQuality> checked_solve(const linalg::SymmetricMatrix& lower, double norm,
                                           const StiffnessFactor& factor, const VecX& b, VecX& x) {
  if (const linalg::SparseCholesky* drained = factor.drained()) {
    return linalg::checked_solve(lower, norm, *drained, b, x);
  }
  factor.solve(b, x);
  if (!x.allFinite()) return tl::unexpected(linalg::solve_refusal(b, x, {}));
  return linalg::SolveQuality{};
}

Result<linalg::SolveQuality> check_rows(const linalg::SymmetricMatrix& lower, double norm,
                                        const StiffnessFactor& factor, const Eigen::MatrixXd& b,
                                        Eigen::MatrixXd& x, StiffnessFactor::Workspace& workspace) {
  if (const linalg::SparseCholesky* drained = factor.drained()) {
    return linalg::check_rows(lower, norm, *drained, b, x, workspace);
  }
  if (x.allFinite()) return linalg::SolveQuality{};
  return tl::unexpected(
      linalg::solve_refusal(b.colwise().sum().transpose(), x.colwise().sum().transpose(), {}));
}

}  // namespace brainshift::fem
