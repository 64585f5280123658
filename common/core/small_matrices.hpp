// SPDX-License-Identifier: Apache-2.0
// Decompositions of 3 x 3 and 6 x 6 matrices. Eigen's templates for them take a compiler up to ten
// seconds each, so they are instantiated here, once.
//
//   symmetric:  A = V diag(values) V^T     values ascending, V orthonormal (Golub and Van Loan,
//                                          Matrix Computations, 4th ed., section 8.3)
//   singular:   A = U diag(values) V^T     values descending (Jacobi, section 8.6)
//
// Nothing fails: entries that are not finite give results that are not.
#pragma once

#include "common/core/types.hpp"

namespace brainshift {

using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

template <int N>
struct SymmetricEigen {
  Eigen::Matrix<double, N, 1> values;
  Eigen::Matrix<double, N, N> vectors;  // one per column
};

// Only the lower triangle is read.
SymmetricEigen<3> symmetric_eigen(const Mat3& A);
SymmetricEigen<6> symmetric_eigen(const Mat6& A);
Vec3 symmetric_eigenvalues(const Mat3& A);
Vec6 symmetric_eigenvalues(const Mat6& A);

struct SingularValues {
  Mat3 U;
  Vec3 values;
  Mat3 V;
};
SingularValues singular_values(const Mat3& A);

// The X of least norm among those that minimise |A X - B|. A is symmetric positive semidefinite;
// eigenvalues below its rounding, 3 eps of the largest, count as zero.
Mat3 least_norm_solution(const Mat3& A, const Mat3& B);

// Of a symmetric positive definite matrix, by LDL^T.
Mat6 symmetric_inverse(const Mat6& A);

}  // namespace brainshift
