// SPDX-License-Identifier: GPL-3.0-or-later
// PrincipalFactor: principal submatrices of one symmetric positive definite matrix M, n x n,
// factorised for one set A of rows and columns after the other:
//
//   D = M_AA + shift I,   k x k
//
// Sets that follow each other differ by few members. The factor K K^T = D_BB of one set B, the
// base, therefore serves its neighbours too. Members a join and members q leave it:
//
//   | D_BB   D_Ba  E_q | | x_B |   | b_B |
//   | D_aB   D_aa   0  | | x_a | = | b_a |      E_q: unit columns of the members that leave;
//   | E_q^T   0     0  | |  l  |   |  0  |      their right-hand side is 0, and so is their x
//
// With V = K^-1 [D_Ba E_q] the Schur complement [D_aa 0; 0 0] - V^T V is quasi-definite, so that
// two small Cholesky factors solve it (Vanderbei 1995, SIAM J. Optim. 5:100). Columns of V are kept
// as long as the base is and there is room. k^3 / 3 flops for a new base, k^2 for a member that
// changes for the first time.
//
// Memory for all n is reserved by the constructor; nothing is allocated afterwards.
#pragma once

#include <memory>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/thread_team.hpp"
#include "common/linalg/blas.hpp"

namespace brainshift::inversion {

// The members of a set, ascending.
void list_active(const contact::ActiveSet& set, std::vector<int>& active);

// out_j = from[set_j]. Eigen's own v(set) copies the set.
inline void gather(const double* from, const std::vector<int>& set, double* out) {
  for (const int member : set) *out++ = from[member];
}

class PrincipalFactor {
 public:
  static constexpr int kMaxChanges = 128;  // columns of V

  // matrix: M, column-major, both triangles; kept as a pointer and read by take() alone. Keeps a
  // reference to the team that shares the work.
  PrincipalFactor(const double* matrix, int size, double shift, ThreadTeam& team);

  // solve() is for this set from now on. set: one flag per row, or empty for none. false when D
  // cannot be factorised; no set is held then.
  [[nodiscard]] bool take(const contact::ActiveSet& set);
  // Forgets set and base, so that what follows rounds as after construction.
  void forget();
  int size() const { return static_cast<int>(active_.size()); }
  const std::vector<int>& active() const { return active_; }  // ascending
  const contact::ActiveSet& set() const { return set_; }

  // B = D^-1 B; k rows. work: work_rows() rows and as many columns as B, overwritten. Several
  // threads may solve at once, each with a work of its own.
  void solve(linalg::blas::Out<double> b, linalg::blas::Out<double> work) const;
  Eigen::Index work_rows() const { return base_size() + changes(); }
  static Eigen::Index most_work_rows(int size) { return size + kMaxChanges; }

 private:
  using Column = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
  Eigen::Index base_size() const { return static_cast<Eigen::Index>(base_.size()); }
  Eigen::Index changes() const { return static_cast<Eigen::Index>(joining_ + leaving_); }
  const double* column(int member) const {
    return matrix_ + static_cast<std::ptrdiff_t>(member) * total_;
  }
  double entry(int row, int col) const { return column(col)[row] + (row == col ? shift_ : 0.0); }
  // K and V; column-major with base_size() and n rows.
  Column factor() const;
  Column columns(Eigen::Index first, Eigen::Index count) const;
  bool make_base();
  // Columns of V for the members of changed_, the joining ones first; false when there is no room.
  bool gather_columns();
  bool factorise_changes();

  const double* matrix_;
  Eigen::Index total_;  // n
  double shift_;
  ThreadTeam& team_;
  contact::ActiveSet set_;
  std::vector<int> active_;
  std::vector<int> base_, row_in_base_;  // members, ascending; by row of M, -1: not of the base
  std::vector<int> row_in_set_;          // by row of M, -1: not in the set
  std::vector<int> changed_;             // members, those that join first
  std::vector<int> cached_;              // members that have a column in cache_
  std::size_t joining_ = 0, leaving_ = 0;
  // Uninitialised: the system hands out memory when it is first used.
  std::unique_ptr<double[]> factor_, cache_, columns_;
  Eigen::MatrixXd schur_;  // of the changes: G of those that join, then [Z^T N]
};

}  // namespace brainshift::inversion
