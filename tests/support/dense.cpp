// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/dense.hpp"

#include <Eigen/Dense>

namespace brainshift::test_support {

using Eigen::MatrixXd;

MatrixXd solve(const MatrixXd& A, const MatrixXd& B) { return A.fullPivLu().solve(B); }
MatrixXd solve_positive(const MatrixXd& A, const MatrixXd& B) { return A.llt().solve(B); }
MatrixXd inverse(const MatrixXd& A) { return A.inverse(); }
MatrixXd cholesky_factor(const MatrixXd& A) { return A.llt().matrixL(); }
VecX eigenvalues(const MatrixXd& A) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(A, Eigen::EigenvaluesOnly).eigenvalues();
}
VecX least_squares(const MatrixXd& A, const VecX& b) { return A.colPivHouseholderQr().solve(b); }

}  // namespace brainshift::test_support
