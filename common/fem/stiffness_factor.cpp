// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/stiffness_factor.hpp"

#include <limits>

namespace brainshift::fem {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

BiotFactor::BiotFactor(BiotMatrix matrix, linalg::SymmetricIndefinite factor)
    : matrix_(std::move(matrix)), factor_(std::move(factor)) {}

Result<BiotFactor> BiotFactor::factorise(BiotMatrix matrix) {
  auto factor = linalg::SymmetricIndefinite::factorise(matrix.lower, matrix.pressure_unknowns);
  if (!factor) return tl::unexpected(factor.error());
  return BiotFactor(std::move(matrix), std::move(*factor));
}

Status BiotFactor::refactorise(const linalg::SymmetricMatrix& stiffness) {
  replace_stiffness(matrix_, stiffness);
  return factor_.refactorise(matrix_.lower);
}

BiotFactor BiotFactor::clone_analysis() const {
  return BiotFactor(matrix_, factor_.clone_analysis());
}

void BiotFactor::solve(const VecX& b, VecX& x) const {
  VecX whole = VecX::Zero(factor_.size());
  whole.head(size()) = b;
  VecX solution;
  if (factor_.solve(whole, solution)) {
    x = solution.head(size());
  } else {
    x = VecX::Constant(size(), kNan);
  }
}

void BiotFactor::solve_rows(const Eigen::MatrixXd& b, Eigen::MatrixXd& x) const {
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(factor_.size(), b.rows());
  whole.topRows(size()) = b.transpose();
  Eigen::MatrixXd solution;
  if (factor_.solve_many(whole, solution)) {
    x = solution.topRows(size()).transpose();
  } else {
    x = Eigen::MatrixXd::Constant(b.rows(), size(), kNan);
  }
}

std::uint64_t BiotFactor::bytes() const {
  return factor_.bytes() +
         static_cast<std::uint64_t>(matrix_.lower.nonZeros()) * (sizeof(double) + sizeof(long));
}

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
  if (const auto* distributed = factor.distributed()) {
    return linalg::check_rows(lower, norm, *distributed, b, x);
  }
  if (x.allFinite()) return linalg::SolveQuality{};
  return tl::unexpected(
      linalg::solve_refusal(b.colwise().sum().transpose(), x.colwise().sum().transpose(), {}));
}

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
