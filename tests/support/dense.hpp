// SPDX-License-Identifier: GPL-3.0-or-later
// Dense linear algebra as a reference, by Eigen; compiled once. Sizes must fit.
#pragma once

#include "common/core/types.hpp"

namespace brainshift::test_support {

// X with A X = B: any square A (LU with full pivoting), or a positive definite one (Cholesky).
Eigen::MatrixXd solve(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
Eigen::MatrixXd solve_positive(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

Eigen::MatrixXd inverse(const Eigen::MatrixXd& A);

// L with L L^T = A.
Eigen::MatrixXd cholesky_factor(const Eigen::MatrixXd& A);

// Of a symmetric matrix, ascending.
VecX eigenvalues(const Eigen::MatrixXd& A);

// The x that minimises |A x - b| (QR).
VecX least_squares(const Eigen::MatrixXd& A, const VecX& b);

}  // namespace brainshift::test_support
