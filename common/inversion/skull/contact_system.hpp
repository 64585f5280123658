// SPDX-License-Identifier: GPL-3.0-or-later
// ContactSystem: forces and depths of a set A of slaves that press on the skull, k of s.
//
//   (Phi_AA + I / beta) f = p_A - L_A z,   P = p - L z - Phi_:A f
//
// L = N^T U: s x r; p: initial penetration. f may pull: whether A is the right set is asked by
// contact_at_loads.hpp. A set of few is solved for by the factor of its own compliance
// (principal_factor.hpp), a set of most by the slaves that it releases (ReleasedSlaves):
// swelling that presses 1,900 of 2,394 slaves on the skull costs a factor of 500 rows.
//
// Memory for all slaves is reserved by the constructor; nothing is allocated afterwards, but for
// what ReleasedSlaves makes once where prepare() was not called.
#pragma once

#include <memory>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/inversion/skull/principal_factor.hpp"
#include "common/linalg/blas.hpp"
#include "common/linalg/growing_matrix.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

// ReleasedSlaves: contact where most slaves press, by the few that do not.
//
// Where all s slaves stick to the skull, D f = b with D = Phi + I / beta and b = p - L z. Slaves Q
// that are released have no force and keep a depth P_Q instead (negative: open):
//
//   D f + P = b with f_Q = 0, P_A = 0   =>   E_QQ P_Q = (E b)_Q,   f_A = (E b)_A - E_AQ P_Q
//
// with E = D^-1: a factor of q x q instead of k x k (ContactSystem). E and E [L p] depend on
// the patient alone. They are made by prepare(), else by the first take(), which costs s^3 flops
// and 8 s^2 bytes: 0.3 s and 46 MiB for 2,394 slaves. Nothing else is allocated after construction.
class ReleasedSlaves {
 public:
  // Keeps references to operators and team. beta: penalty, N/mm.
  ReleasedSlaves(const CondensedOperators& operators, ModeWindow window, double beta,
                 ThreadTeam& team);

  // Makes E, so that no update pays for it. Where D cannot be factorised, take() says so.
  void prepare() { made_ = made_ || make_inverse(); }
  // What follows is for this set of pressing slaves. false when D, or E of those that are
  // released, cannot be factorised.
  [[nodiscard]] bool take(const contact::ActiveSet& pressing);
  void forget() { factor_.forget(); }

  // f_A (k, N) and the penetration of every slave (s, mm) for modes z: f_i / beta where it presses.
  void solve(const VecX& z, Eigen::Ref<VecX> forces, VecX& penetration);
  // D_AA^-1 [L_A p_A], k x (r + 1).
  void respond(Eigen::Ref<Eigen::MatrixXd> out);
  // ContactSystem::respond_to_changes.
  void respond_to_changes(const std::vector<int>& left, const std::vector<int>& joined,
                          Eigen::Ref<Eigen::MatrixXd> out);
  // out += L_A^T D_AA^-1 felt. felt: k; out: r.
  void add_adjoint(const Eigen::Ref<const VecX>& felt, VecX& out);
  // B = D_AA^-1 B for any right-hand sides, k rows. Allocates.
  void solve(linalg::blas::Out<double> b);

 private:
  Eigen::Index slaves() const { return operators_.num_slaves(); }
  Eigen::Map<Eigen::MatrixXd> inverse() const { return {inverse_.get(), slaves(), slaves()}; }
  const double* column(int slave) const { return inverse_.get() + slaves() * slave; }
  bool make_inverse();
  // E_QA, q x k.
  Eigen::Map<Eigen::MatrixXd> gather_between();

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

class ContactSystem {
 public:
  // From this part of all slaves on, a set is solved for by those that it releases.
  static constexpr double kMax = 0.6;

  // Keeps references to operators and team. beta: penalty, N/mm.
  ContactSystem(const CondensedOperators& operators, ModeWindow window, double beta,
                ThreadTeam& team);

  // ReleasedSlaves::prepare().
  void prepare() { released_.prepare(); }
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
  // Y = D_AA^-1 [D_AQ E_a], D = Phi + I / beta, for slaves Q that are not in the set and slaves a
  // that are (E_a: their unit columns): what the forces follow when Q left the set and a joined it.
  // At most r + 1 columns.
  void respond_to_changes(const std::vector<int>& left, const std::vector<int>& joined,
                          Eigen::Ref<Eigen::MatrixXd> out);
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
  Eigen::MatrixXd modes_of_slave_;  // L^T, r x s
  Eigen::MatrixXd work_;            // of PrincipalFactor::solve
  linalg::GrowingVector adjoint_;
};

// penetration -= Phi_:S change for slaves S, shared by the team. change: one per slave of S, N.
void subtract_penetration(const CondensedOperators& operators, const std::vector<int>& slaves,
                          const Eigen::Ref<const VecX>& change, ThreadTeam& team,
                          VecX& penetration);

}  // namespace brainshift::inversion
