// SPDX-License-Identifier: GPL-3.0-or-later
// DistributedCholesky: K^-1 of a symmetric positive definite matrix by several processes, each of
// which holds a part of the factor (docs/decisions/0042).
//
// The unknowns are dealt into parts, one per process. Those that meet a part of lower number are
// the interface b; what is left of part r, its interior i_r, meets no other interior. So
//
//   S = K_bb - sum over r  K_bi K_ii^-1 K_ib          X_b = S^-1 (B_b - sum K_bi K_ii^-1 B_i)
//
// and the sums' terms belong to one process each: it factorises K on (i_r, the interface that
// meets it), interface last (SparseCholesky). S is a sum over processes (Ranks::factorise). With
// one process the interface is empty.
//
// Every process reads the whole matrix, and computes the partition from it. Errors are the same
// everywhere.
#pragma once

#include <memory>
#include <vector>

#include "common/linalg/checked_solve.hpp"
#include "common/linalg/cholesky.hpp"
#include "common/ranks/ranks.hpp"

namespace brainshift::linalg {

class DistributedCholesky {
 public:
  // part: of each unknown, in [0, ranks.size()). Keeps a reference to ranks. Errors as
  // SparseCholesky::factorise and Ranks::factorise.
  static Result<DistributedCholesky> factorise(const SymmetricMatrix& lower,
                                               const std::vector<int>& part, Ranks& ranks);
  DistributedCholesky(DistributedCholesky&&) noexcept;
  DistributedCholesky& operator=(DistributedCholesky&&) noexcept;
  ~DistributedCholesky();

  // Each process gives right-hand sides of its own, one per row (k x n, k may differ and be 0), and
  // gets their solutions. NaN everywhere where S could not be solved with.
  void solve_rows(const Eigen::MatrixXd& b, Eigen::MatrixXd& x) const;
  void solve(const VecX& b, VecX& x) const;

  Ranks& ranks() const;
  int size() const;
  int interface_size() const;
  double rcond() const;            // the least of the processes' (SparseCholesky::rcond)
  std::uint64_t nonzeros() const;  // of this process's part, as the next three
  std::uint64_t bytes() const;
  double analyse_seconds() const;
  double factor_seconds() const;

 private:
  struct Impl;
  explicit DistributedCholesky(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// After factor.solve_rows(B, X): backward error of the own rows (checked_solve.hpp). Nothing is
// refined. The same error everywhere when it is above kRefuseAbove in any process.
Result<SolveQuality> check_rows(const SymmetricMatrix& lower, double norm,
                                const DistributedCholesky& factor, const Eigen::MatrixXd& b,
                                const Eigen::MatrixXd& x);

}  // namespace brainshift::linalg
