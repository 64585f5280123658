// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/blas.hpp"

#include <cblas.h>

#include <algorithm>
#include <cassert>
#include <vector>

#include "common/core/thread_team.hpp"

// LAPACK's names, as Fortran spells them.
// NOLINTBEGIN(readability-identifier-naming)
extern "C" {
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dpotri_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dsytd2_(const char* uplo, const int* n, double* a, const int* lda, double* d, double* e,
             double* tau, int* info);
void dgeqrf_(const int* m, const int* n, double* a, const int* lda, double* tau, double* work,
             const int* lwork, int* info);
void dorgqr_(const int* m, const int* n, const int* k, double* a, const int* lda, const double* tau,
             double* work, const int* lwork, int* info);
}
// NOLINTEND(readability-identifier-naming)

namespace brainshift::linalg::blas {
namespace {

template <typename Matrix>
int leading(const Matrix& matrix) {
  // BLAS wants at least 1, also for an empty matrix.
  return static_cast<int>(std::max<Eigen::Index>(1, matrix.outerStride()));
}
template <typename Matrix>
int rows(const Matrix& matrix) {
  return static_cast<int>(matrix.rows());
}
template <typename Matrix>
int columns(const Matrix& matrix) {
  return static_cast<int>(matrix.cols());
}

// dtrsm packs the factor first, which costs more than one column's solution does.
void solve_one(CBLAS_TRANSPOSE transposed, const In<double>& l, Out<double> b) {
  cblas_dtrsv(CblasColMajor, CblasLower, transposed, CblasNonUnit, rows(b), l.data(), leading(l),
              b.data(), 1);
}

}  // namespace

void multiply(double alpha, const In<double>& a, const In<double>& b, double beta, Out<double> c) {
  assert(a.cols() == b.rows() && c.rows() == a.rows() && c.cols() == b.cols());
  cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, rows(c), columns(c), columns(a), alpha,
              a.data(), leading(a), b.data(), leading(b), beta, c.data(), leading(c));
}

void multiply(float alpha, const In<float>& a, const In<float>& b, float beta, Out<float> c) {
  assert(a.cols() == b.rows() && c.rows() == a.rows() && c.cols() == b.cols());
  cblas_sgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, rows(c), columns(c), columns(a), alpha,
              a.data(), leading(a), b.data(), leading(b), beta, c.data(), leading(c));
}

void multiply_transposed(double alpha, const In<double>& a, const In<double>& b, double beta,
                         Out<double> c) {
  assert(a.rows() == b.rows() && c.rows() == a.cols() && c.cols() == b.cols());
  cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, rows(c), columns(c), rows(a), alpha,
              a.data(), leading(a), b.data(), leading(b), beta, c.data(), leading(c));
}

void multiply_by_transposed(double alpha, const In<double>& a, const In<double>& b, double beta,
                            Out<double> c) {
  assert(a.cols() == b.cols() && c.rows() == a.rows() && c.cols() == b.rows());
  cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, rows(c), columns(c), columns(a), alpha,
              a.data(), leading(a), b.data(), leading(b), beta, c.data(), leading(c));
}

void subtract_outer(const In<double>& a, Out<double> c) {
  assert(c.rows() == a.rows() && c.cols() == a.rows());
  cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, rows(c), columns(a), -1.0, a.data(),
              leading(a), 1.0, c.data(), leading(c));
}

void gram(const In<double>& a, double beta, Out<double> c) {
  assert(c.rows() == a.cols() && c.cols() == a.cols());
  cblas_dsyrk(CblasColMajor, CblasLower, CblasTrans, rows(c), rows(a), 1.0, a.data(), leading(a),
              beta, c.data(), leading(c));
}

bool cholesky(Out<double> a) {
  assert(a.rows() == a.cols());
  const char lower = 'L';
  const int n = rows(a), lda = leading(a);
  int info = 0;
  if (n > 0) dpotrf_(&lower, &n, a.data(), &lda, &info);
  return info == 0;
}

bool invert_factored(Out<double> l) {
  assert(l.rows() == l.cols());
  const char lower = 'L';
  const int n = rows(l), lda = leading(l);
  int info = 0;
  if (n > 0) dpotri_(&lower, &n, l.data(), &lda, &info);
  return info == 0;
}

void orthonormalise(Out<double> a) {
  assert(a.rows() >= a.cols());
  if (a.size() == 0) return;
  const int m = rows(a), n = columns(a), stride = leading(a);
  constexpr int kWorkPerColumn = 64;  // of LAPACK's blocks
  const int size = kWorkPerColumn * n;
  std::vector<double> scales(static_cast<std::size_t>(n)), work(static_cast<std::size_t>(size));
  int info = 0;  // of arguments only
  dgeqrf_(&m, &n, a.data(), &stride, scales.data(), work.data(), &size, &info);
  assert(info == 0);
  dorgqr_(&m, &n, &n, a.data(), &stride, scales.data(), work.data(), &size, &info);
  assert(info == 0);
}

void tridiagonalise(Out<double> a, Eigen::Ref<Eigen::VectorXd> b,
                    Eigen::Ref<Eigen::VectorXd> diagonal, Eigen::Ref<Eigen::VectorXd> beside,
                    Eigen::Ref<Eigen::VectorXd> scales) {
  assert(a.rows() == a.cols() && b.size() == a.rows() && diagonal.size() == a.rows());
  const int n = rows(a), stride = leading(a);
  if (n == 0) return;
  assert(beside.size() == n - 1 && scales.size() == n - 1);
  int info = 0;  // of arguments only
  dsytd2_("L", &n, a.data(), &stride, diagonal.data(), beside.data(), scales.data(), &info);
  assert(info == 0);
  // Q = H_1 ... H_n-1, H_i = 1 - scale v v^T with v = (0, 1, column i below that).
  for (int i = 0; i + 1 < n; ++i) {
    const auto v = a.col(i).tail(n - i - 2);
    const double along = scales[i] * (b[i + 1] + v.dot(b.tail(n - i - 2)));
    b[i + 1] -= along;
    b.tail(n - i - 2) -= along * v;
  }
}

void solve_lower(const In<double>& l, Out<double> b) {
  assert(l.rows() == b.rows());
  if (b.cols() == 1) return solve_one(CblasNoTrans, l, b);
  cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, rows(b), columns(b),
              1.0, l.data(), leading(l), b.data(), leading(b));
}

void solve_lower_transposed(const In<double>& l, Out<double> b) {
  assert(l.rows() == b.rows());
  if (b.cols() == 1) return solve_one(CblasTrans, l, b);
  cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, CblasTrans, CblasNonUnit, rows(b), columns(b),
              1.0, l.data(), leading(l), b.data(), leading(b));
}

void solve_lower_right(const In<double>& l, Out<double> b) {
  assert(l.rows() == b.cols());
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasNoTrans, CblasNonUnit, rows(b),
              columns(b), 1.0, l.data(), leading(l), b.data(), leading(b));
}

void solve_lower_transposed_right(const In<double>& l, Out<double> b) {
  assert(l.rows() == b.cols());
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, rows(b), columns(b),
              1.0, l.data(), leading(l), b.data(), leading(b));
}

void solve_lower_transposed_right(const In<float>& l, Out<float> b) {
  assert(l.rows() == b.cols());
  cblas_strsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, rows(b), columns(b),
              1.0F, l.data(), leading(l), b.data(), leading(b));
}

void add_scaled(long n, double alpha, const double* x, double* y) {
  cblas_daxpy(static_cast<int>(n), alpha, x, 1, y, 1);
}
void add_scaled(long n, float alpha, const float* x, float* y) {
  cblas_saxpy(static_cast<int>(n), alpha, x, 1, y, 1);
}

}  // namespace brainshift::linalg::blas

namespace brainshift::linalg {
namespace {

using Eigen::Index;

constexpr Index kTeamBlock = 96;
// Below this size the team's waking costs more than it saves.
constexpr Index kSmall = 256;

}  // namespace

bool cholesky(blas::Out<double> a, ThreadTeam& team) {
  assert(a.rows() == a.cols());
  const Index n = a.rows();
  if (n <= kSmall) return blas::cholesky(a);
  for (Index first = 0; first < n; first += kTeamBlock) {
    const Index width = std::min(kTeamBlock, n - first);
    auto corner = a.block(first, first, width, width);
    if (!blas::cholesky(corner)) return false;
    const Index below = first + width, rest = n - below;
    const Index blocks = (rest + kTeamBlock - 1) / kTeamBlock;
    const auto begin = [&](Index block) { return below + block * kTeamBlock; };
    const auto size = [&](Index block) { return std::min(kTeamBlock, n - begin(block)); };
    team.split(blocks, [&](long from, long to) {
      for (Index i = from; i < to; ++i) {
        blas::solve_lower_transposed_right(corner, a.block(begin(i), first, size(i), width));
      }
    });
    // Column j of the blocks that are left, and its mirror image, cost as much together as any
    // other such pair.
    team.split((blocks + 1) / 2, [&](long from, long to) {
      const auto update = [&](Index j) {
        const auto right = a.block(begin(j), first, size(j), width);
        blas::subtract_outer(right, a.block(begin(j), begin(j), size(j), size(j)));
        const Index next = begin(j) + size(j);
        if (next < n) {
          blas::multiply_by_transposed(-1.0, a.block(next, first, n - next, width), right, 1.0,
                                       a.block(next, begin(j), n - next, size(j)));
        }
      };
      for (Index j = from; j < to; ++j) {
        update(j);
        if (blocks - 1 - j != j) update(blocks - 1 - j);
      }
    });
  }
  return true;
}

}  // namespace brainshift::linalg
