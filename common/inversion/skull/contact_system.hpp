// SPDX-License-Identifier: GPL-3.0-or-later
// ContactSystem: forces and depths of a set A of slaves that press on the skull, k of s.
//
//   (Phi_AA + I / beta) f = p_A - L_A z,   P = p - L z - Phi_:A f
//
// L = N^T U: s x r; p: initial penetration. f may pull: whether A is the right set is asked by
// contact_at_loads.hpp. A set of few is solved for by the factor of its own compliance
// (principal_factor.hpp), a set of most by the slaves that it releases (released_slaves.hpp):
// swelling that presses 1,900 of 2,394 slaves on the skull costs a factor of 500 rows.
//
// Memory for all slaves is reserved by the constructor; nothing is allocated afterwards, but for
// what ReleasedSlaves makes once.
#pragma once

#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/inversion/skull/principal_factor.hpp"
#include "common/inversion/skull/released_slaves.hpp"
#include "common/linalg/growing_matrix.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

class ContactSystem {
 public:
  // From this part of all slaves on, a set is solved for by those that it releases.
  static constexpr double kMost = 0.6;

  // Keeps references to operators and team. beta: penalty, N/mm.
  ContactSystem(const CondensedOperators& operators, ModeWindow window, double beta,
                ThreadTeam& team);

  // What follows is for this set. set: one flag per slave, or empty for none. kSingularMatrix when
  // its compliance cannot be factorised; no set is held then.
  Status take(const contact::ActiveSet& set);
  // Forgets the set, so that what follows rounds as after construction.
  void forget();
  int size() const { return static_cast<int>(active_.size()); }
  const std::vector<int>& active() const { return active_; }  // slaves, ascending
  const contact::ActiveSet& set() const { return set_; }

  // f (k, N) and P (s, mm) for modes z; free_penetration: p - L z of all slaves.
  void solve(const VecX& z, const VecX& free_penetration, Eigen::Ref<VecX> forces,
             VecX& penetration);
  // [T f0] = (Phi_AA + I / beta)^-1 [L_A p_A], k x (r + 1).
  void respond(Eigen::Ref<Eigen::MatrixXd> out);
  // out += T^T felt. felt: one per active slave; out: r.
  void add_adjoint(const Eigen::Ref<const VecX>& felt, VecX& out);
  // B = (Phi_AA + I / beta)^-1 B for any right-hand sides, k rows. Allocates.
  void solve(linalg::blas::Out<double> b);

 private:
  const CondensedOperators& operators_;
  ModeWindow window_;
  double beta_;
  ThreadTeam& team_;
  PrincipalFactor pressing_;
  ReleasedSlaves released_;
  contact::ActiveSet set_;
  std::vector<int> active_;
  bool by_released_ = false;
  Eigen::MatrixXd work_;  // of PrincipalFactor::solve
  linalg::GrowingVector adjoint_;
};

// penetration -= Phi_:S change for slaves S, shared by the team. change: one per slave of S, N.
void subtract_penetration(const CondensedOperators& operators, const std::vector<int>& slaves,
                          const Eigen::Ref<const VecX>& change, ThreadTeam& team,
                          VecX& penetration);

}  // namespace brainshift::inversion
