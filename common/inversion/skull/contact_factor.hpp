// SPDX-License-Identifier: GPL-3.0-or-later
// ContactFactor: the compliance of a set A of active slaves with its penalty, factorised:
//
//   D = Phi_AA + I / beta,   symmetric positive definite, k x k
//
// Sets that follow each other differ by few slaves. The factor K K^T = D_BB of one set B, the base,
// therefore serves its neighbours too. Slaves a join and slaves q leave it:
//
//   | D_BB   D_Ba  E_q | | x_B |   | b_B |
//   | D_aB   D_aa   0  | | x_a | = | b_a |      E_q: unit columns of the slaves that leave;
//   | E_q^T   0     0  | |  l  |   |  0  |      their right-hand side is 0, and so is their x
//
// With V = K^-1 [D_Ba E_q] the Schur complement [D_aa 0; 0 0] - V^T V is quasi-definite, so that
// two small Cholesky factors solve it (Vanderbei 1995, SIAM J. Optim. 5:100). Columns of V are kept
// as long as the base is. k^3 / 3 flops for a new base, k^2 for a slave that changes for the first
// time.
//
// Memory for all slaves is reserved by the constructor; nothing is allocated afterwards.
#pragma once

#include <memory>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/linalg/blas.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

// The slaves of a set, ascending.
void list_active(const contact::ActiveSet& set, std::vector<int>& active);

class ContactFactor {
 public:
  static constexpr int kMostChanges = 128;  // columns of V

  // Keeps references to the operators and to the team that shares the work. beta: penalty, N/mm.
  ContactFactor(const CondensedOperators& operators, double beta, ThreadTeam& team);

  // solve() is for this set from now on. set: one flag per slave, or empty for none.
  // kSingularMatrix when D cannot be factorised; no set is held then.
  Status take(const contact::ActiveSet& set);
  // Forgets set and base, so that what follows rounds as after construction.
  void forget();
  int size() const { return static_cast<int>(active_.size()); }
  const std::vector<int>& active() const { return active_; }
  const contact::ActiveSet& set() const { return set_; }

  // B = D^-1 B; k rows. work: work_rows() rows and as many columns as B, overwritten. Several
  // threads may solve at once, each with a work of its own.
  void solve(linalg::blas::Out<double> b, linalg::blas::Out<double> work) const;
  Eigen::Index work_rows() const { return base_size() + changes(); }
  static Eigen::Index most_work_rows(const CondensedOperators& operators) {
    return operators.num_slaves() + kMostChanges;
  }

 private:
  using Column = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
  Eigen::Index base_size() const { return static_cast<Eigen::Index>(base_.size()); }
  Eigen::Index changes() const { return static_cast<Eigen::Index>(joining_ + leaving_); }
  // K and V; column-major with base_size() and num_slaves() rows.
  Column factor() const;
  Column columns(Eigen::Index first, Eigen::Index count) const;
  double entry(int row, int column) const;
  Status make_base();
  // Columns of V for the slaves of changed_, the joining ones first; false when there is no room.
  bool gather_columns();
  bool factorise_changes();

  const CondensedOperators& operators_;
  double beta_;
  ThreadTeam& team_;
  contact::ActiveSet set_;
  std::vector<int> active_;
  std::vector<int> base_, row_in_base_;  // slaves, ascending; by slave, -1: not of the base
  std::vector<int> row_in_set_;          // by slave, -1: not active
  std::vector<int> changed_;             // slaves, those that join first
  std::vector<int> cached_;              // slaves that have a column in cache_
  std::size_t joining_ = 0, leaving_ = 0;
  // Uninitialised: the system hands out memory when it is first used.
  std::unique_ptr<double[]> factor_, cache_, columns_;
  Eigen::MatrixXd schur_;  // of the changes: G of those that join, then [Z^T N]
};

}  // namespace brainshift::inversion
