// SPDX-License-Identifier: GPL-3.0-or-later
// SymmetricIndefinite: L D L^T of a symmetric quasi-definite matrix (MUMPS, nested dissection).
//
//   A = [ K  -G ; -G^T  -C ]     K and C positive definite
//
// A has as many negative pivots as C has rows, whatever the order of elimination (Vanderbei 1995,
// SIAM J. Optim. 5:100). Rows and columns are scaled to a unit diagonal first, because
// displacements and pressures differ by many orders of magnitude.
// Checks, in this order: finite input -> status -> inertia -> reciprocal condition -> residual of
// every solve, with at most two steps of iterative refinement -> finite output. Each error names
// its cause.
//
// MUMPS keeps global state: calls from several threads are safe and wait for each other.
#pragma once

#include <cstdint>
#include <memory>

#include "common/core/error.hpp"
#include "common/linalg/symmetric_matrix.hpp"

namespace brainshift::linalg {

class SymmetricIndefinite {
 public:
  // Estimated in the 1-norm of the scaled matrix (Hager 1984). A floating body has about 1e-17, a
  // head 1e-7.
  static constexpr double kMinRcond = 1e-14;
  // A solve is refined when its backward error |b - A x| / (|A| |x| + |b|) (maximum norms of the
  // scaled system) is larger than this, and fails if that does not help.
  static constexpr double kMaxBackwardError = 1e-10;

  // lower: lower triangle, diagonal stored. kNotFinite; kEmptySet; kSingularMatrix.
  // kFloatingBody: wrong inertia or reciprocal condition, i.e. not enough support, or
  // incompressible fluid in a body that cannot change its volume.
  static Result<SymmetricIndefinite> factorise(const SymmetricMatrix& lower, int negative_pivots);
  SymmetricIndefinite(SymmetricIndefinite&&) noexcept;
  SymmetricIndefinite& operator=(SymmetricIndefinite&&) noexcept;
  ~SymmetricIndefinite();

  // New values, same pattern: reuses ordering and analysis. After a failure the factor must not
  // be used until a refactorise succeeds.
  Status refactorise(const SymmetricMatrix& lower);
  // A second factor with the same ordering and pattern, no values yet; call refactorise on it.
  SymmetricIndefinite clone_analysis() const;

  // x = A^-1 b. kNotFinite; kNotConverged names the backward error.
  Status solve(const VecX& b, VecX& x) const;
  // One right-hand side per column. The residual of a block is that of a combination of its
  // columns with fixed pseudo-random signs. When that residual is too large, every column is
  // checked and refined.
  Status solve_many(const Eigen::MatrixXd& b, Eigen::MatrixXd& x) const;

  int size() const;
  double rcond() const;
  std::uint64_t nonzeros() const;  // of L
  std::uint64_t bytes() const;     // of factor and matrix
  double analyse_seconds() const;
  double factor_seconds() const;  // of the last (re)factorisation, the condition estimate included
  // Of the last solve: backward error after refinement, and steps taken.
  struct SolveCheck {
    double backward_error = 0.0;
    int refinements = 0;
  };
  SolveCheck last_check() const;

 private:
  struct Impl;
  explicit SymmetricIndefinite(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::linalg
