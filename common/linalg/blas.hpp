// SPDX-License-Identifier: GPL-3.0-or-later
// The few dense kernels of the hot path, on the system's BLAS and LAPACK. Those choose their
// instructions at run time; code compiled for any x86-64 cannot. Column-major views; nothing is
// allocated here unless it says so.
// Preconditions: shapes agree, outputs do not overlap inputs (asserted in debug builds).
#pragma once

#include <Eigen/Core>

namespace brainshift {
class ThreadTeam;
}

namespace brainshift::linalg::blas {

template <typename T>
using In =
    Eigen::Ref<const Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>, 0, Eigen::OuterStride<>>;
template <typename T>
using Out = Eigen::Ref<Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>, 0, Eigen::OuterStride<>>;

// C = alpha A B + beta C
void multiply(double alpha, const In<double>& a, const In<double>& b, double beta, Out<double> c);
void multiply(float alpha, const In<float>& a, const In<float>& b, float beta, Out<float> c);
// C = alpha A^T B + beta C
void multiply_transposed(double alpha, const In<double>& a, const In<double>& b, double beta,
                         Out<double> c);
// C = alpha A B^T + beta C
void multiply_by_transposed(double alpha, const In<double>& a, const In<double>& b, double beta,
                            Out<double> c);
// Lower triangle of C = C - A A^T.
void subtract_outer(const In<double>& a, Out<double> c);
// Lower triangle of C = A^T A + beta C.
void gram(const In<double>& a, double beta, Out<double> c);
// Lower triangle of A -> L with L L^T = A, in place; false when A is not positive definite.
[[nodiscard]] bool cholesky(Out<double> a);
// Lower factor L -> lower triangle of (L L^T)^-1, in place; false when L is singular.
[[nodiscard]] bool invert_factored(Out<double> l);
// A, m x n with n <= m, -> m x n with orthonormal columns that span those of A (Q of its QR
// factorisation), in place. Allocates.
void orthonormalise(Out<double> a);
// A = Q T Q^T with T tridiagonal, and b -> Q^T b. a: lower triangle of A, overwritten;
// diagonal: n, beside: n - 1 numbers, of T; scales: n - 1, work. n = A.rows() = b.size(). By
// Householder's reflections, one column after the other: for small matrices (Golub & Van Loan 2013,
// Matrix Computations, 8.3.1).
void tridiagonalise(Out<double> a, Eigen::Ref<Eigen::VectorXd> b,
                    Eigen::Ref<Eigen::VectorXd> diagonal, Eigen::Ref<Eigen::VectorXd> beside,
                    Eigen::Ref<Eigen::VectorXd> scales);
// B = L^-1 B and B = L^-T B.
void solve_lower(const In<double>& l, Out<double> b);
void solve_lower_transposed(const In<double>& l, Out<double> b);
// B = B L^-1 and B = B L^-T.
void solve_lower_right(const In<double>& l, Out<double> b);
void solve_lower_transposed_right(const In<double>& l, Out<double> b);
void solve_lower_transposed_right(const In<float>& l, Out<float> b);
// y += alpha x, n entries
void add_scaled(long n, double alpha, const double* x, double* y);
void add_scaled(long n, float alpha, const float* x, float* y);

}  // namespace brainshift::linalg::blas

namespace brainshift::linalg {

// The Cholesky factor of a dense matrix, with the work shared by a ThreadTeam.
// Lower triangle of A -> L with L L^T = A, in place; false when A is not positive definite. The
// upper triangle may be overwritten. In blocks (Golub & Van Loan 2013, Matrix Computations, 4.2.9:
// outer products), each computed by one member and the same whatever their number is, so that the
// result does not depend on the team. Does not allocate.
[[nodiscard]] bool cholesky(blas::Out<double> a, ThreadTeam& team);

}  // namespace brainshift::linalg
