// SPDX-License-Identifier: GPL-3.0-or-later
// ReleasedSlaves: contact where most slaves press, by the few that do not.
//
// Where all s slaves stick to the skull, D f = b with D = Phi + I / beta and b = p - L z. Slaves Q
// that are released have no force and keep a depth P_Q instead (negative: open):
//
//   D f + P = b with f_Q = 0, P_A = 0   =>   E_QQ P_Q = (E b)_Q,   f_A = (E b)_A - E_AQ P_Q
//
// with E = D^-1: a factor of q x q instead of k x k (contact_system.hpp). E and E [L p] depend on
// the patient alone. They are made by the first take(), which costs s^3 flops and 8 s^2 bytes, in
// scenes that need them: 0.3 s and 46 MiB for 2,394 slaves. Besides, nothing is allocated after
// construction.
#pragma once

#include <memory>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/inversion/skull/principal_factor.hpp"
#include "common/linalg/blas.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

class ReleasedSlaves {
 public:
  // Keeps references to operators and team. beta: penalty, N/mm.
  ReleasedSlaves(const CondensedOperators& operators, ModeWindow window, double beta,
                 ThreadTeam& team);

  // What follows is for this set of pressing slaves. false when D, or E of those that are
  // released, cannot be factorised.
  [[nodiscard]] bool take(const contact::ActiveSet& pressing);
  void forget() { factor_.forget(); }

  // f_A (k, N) and the penetration of every slave (s, mm) for modes z: f_i / beta where it presses.
  void solve(const VecX& z, Eigen::Ref<VecX> forces, VecX& penetration);
  // D_AA^-1 [L_A p_A], k x (r + 1).
  void respond(Eigen::Ref<Eigen::MatrixXd> out);
  // out += L_A^T D_AA^-1 felt. felt: k; out: r.
  void add_adjoint(const Eigen::Ref<const VecX>& felt, VecX& out);
  // B = D_AA^-1 B for any right-hand sides, k rows. Allocates.
  void solve(linalg::blas::Out<double> b);

 private:
  Eigen::Index slaves() const { return operators_.num_slaves(); }
  Eigen::Map<Eigen::MatrixXd> inverse() const { return {inverse_.get(), slaves(), slaves()}; }
  const double* column(int slave) const { return inverse_.get() + slaves() * slave; }
  bool make_inverse();

  const CondensedOperators& operators_;
  ModeWindow window_;
  double beta_;
  ThreadTeam& team_;
  // Uninitialised: the system hands out memory when it is first used.
  std::unique_ptr<double[]> inverse_;  // E, both triangles
  bool made_ = false;
  PrincipalFactor factor_;  // of E_QQ
  contact::ActiveSet released_set_;
  std::vector<int> pressing_;           // ascending
  Eigen::MatrixXd loads_;               // E [L p], s x (r + 1)
  VecX all_;                            // s
  VecX released_;                       // q
  Eigen::MatrixXd response_, work_;     // of Q: q x (r + 1), and what solving for it needs
  std::unique_ptr<double[]> gathered_;  // E_QA
};

}  // namespace brainshift::inversion
