// SPDX-License-Identifier: GPL-3.0-or-later
// SparseCholesky: supernodal L L^T of a symmetric positive definite matrix (CHOLMOD, nested
// dissection).
//
// CHOLMOD reports success for NaN, for infinity and for some singular matrices. So every
// factorisation is checked: lower triangle -> finite input -> no negative or zero pivot ->
// reciprocal condition estimate above kMinRcond. checked_solve.hpp checks the solves.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <memory>
#include <span>

#include "common/core/error.hpp"
#include "common/linalg/symmetric_matrix.hpp"

namespace brainshift::linalg {

// X = (L L^T)^-1 B for a block of right-hand sides, by the supernodes of L.
//
// The block lies with the numbers of one unknown side by side (k x n, k right-hand sides), so that
// what is gathered and scattered at a supernode's rows are whole columns. A supernode whose
// unknowns are all 0 in every right-hand side is passed over: a load at a few nodes reaches only
// their ancestors in the elimination tree (Gilbert and Peierls 1988, SIAM J. Sci. Stat. Comput.
// 9:862). Loads that are near each other have most ancestors in common, so it pays to solve such
// loads together.

// A view of L. Supernode s has the unknowns [first[s], first[s + 1]), and its columns are dense
// below each other: rows row_of[rows[s] ... rows[s + 1]), the unknowns themselves first, numbers
// from values[at[s]], column-major.
struct SupernodalView {
  std::span<const long> first;  // of s supernodes, s + 1 numbers; rows alike
  std::span<const long> rows;
  std::span<const long> at;
  const long* row_of = nullptr;
  const double* values = nullptr;
};

// In place. x: k x n, in the order of L's unknowns. scratch: keeps its memory between calls.
void substitute(const SupernodalView& l, Eigen::MatrixXd& x, Eigen::MatrixXd& scratch);

class SparseCholesky {
 public:
  // A free-floating body has a reciprocal pivot ratio of rounding size (1e-15); a head with
  // sliding support has about 1e-5, and down to 1e-8 with penalty springs.
  static constexpr double kMinRcond = 1e-13;

  // lower: lower triangle, sorted. kInvalidArgument: an entry above the diagonal. kNotFinite.
  // kFloatingBody: a pivot vanished, i.e. not enough support. kSingularMatrix.
  // kept: so many of the last unknowns are eliminated last (reduce_rows).
  static Result<SparseCholesky> factorise(const SymmetricMatrix& lower, int kept = 0);
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
  // right-hand side than single solves (substitute).
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

  // A solve in two halves about the kept unknowns b of factorise(), i the others. Between the two
  // the workspace holds what the first one left.
  //   reduce_rows   G = -K_bi K_ii^-1 B_i     b: k x i, g: k x b
  //   finish_rows   X_i = K_ii^-1 (B_i - K_ib X_b)
  void reduce_rows(const Eigen::MatrixXd& b, Eigen::MatrixXd& g, Workspace& workspace) const;
  void finish_rows(const Eigen::MatrixXd& kept, Eigen::MatrixXd& x, Workspace& workspace) const;
  // Lower triangle of K_bb - K_bi K_ii^-1 K_ib.
  Eigen::MatrixXd schur_complement() const;
  // Frees the columns of the kept unknowns. Afterwards only the two halves of a solve work.
  void drop_kept();

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
