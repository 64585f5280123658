// SPDX-License-Identifier: GPL-3.0-or-later
// SparseCholesky: supernodal L L^T of a symmetric positive definite matrix (CHOLMOD, nested
// dissection).
//
// CHOLMOD reports success for NaN, for infinity and for some singular matrices. So every
// factorisation is checked: lower triangle -> finite input -> no negative or zero pivot ->
// reciprocal condition estimate above kMinRcond. checked_solve.hpp checks the solves.
#pragma once

#include <cstdint>
#include <memory>

#include "common/core/error.hpp"
#include "common/linalg/symmetric_matrix.hpp"

namespace brainshift::linalg {

class SparseCholesky {
 public:
  // A free-floating body has a reciprocal pivot ratio of rounding size (1e-15); a head with
  // sliding support has about 1e-5, and down to 1e-8 with penalty springs.
  static constexpr double kMinRcond = 1e-13;

  // lower: lower triangle, sorted. kInvalidArgument: an entry above the diagonal. kNotFinite.
  // kFloatingBody: a pivot vanished, i.e. not enough support. kSingularMatrix.
  static Result<SparseCholesky> factorise(const SymmetricMatrix& lower);
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;
  ~SparseCholesky();

  // New values, same pattern: reuses the ordering and symbolic analysis. After a failure the
  // factor must not be used until a refactorise succeeds.
  Status refactorise(const SymmetricMatrix& lower);
  // A second factor with the same ordering and pattern, no values yet; call refactorise on it.
  SparseCholesky clone_analysis() const;

  // x = K^-1 b. Not thread-safe: workspace is reused between calls.
  void solve(const VecX& b, VecX& x) const;
  VecX solve(const VecX& b) const;
  // Several right-hand sides at once, one per row (k x n, also the solutions); cheaper per
  // right-hand side than single solves (block_substitution.hpp).
  Eigen::MatrixXd solve_rows(const Eigen::MatrixXd& b) const;

  // Scratch memory for one thread that solves with a factor shared by several threads.
  class Workspace {
   public:
    Workspace();
    Workspace(Workspace&&) noexcept;
    Workspace& operator=(Workspace&&) noexcept;
    ~Workspace();

   private:
    friend class SparseCholesky;
    struct Impl;
    std::unique_ptr<Impl> impl_;
  };
  // The same. Thread-safe if every thread has its own workspace.
  void solve_rows(const Eigen::MatrixXd& b, Eigen::MatrixXd& x, Workspace& workspace) const;

  int size() const;
  double rcond() const;            // CHOLMOD's estimate: squared ratio of extreme pivots of L
  std::uint64_t nonzeros() const;  // of L
  std::uint64_t bytes() const;     // of the factor
  double analyse_seconds() const;
  double factor_seconds() const;  // of the last (re)factorisation

 private:
  struct Impl;
  explicit SparseCholesky(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::linalg
