// SPDX-License-Identifier: GPL-3.0-or-later
// ContactAtLoads: the contact forces f for fixed loads, that is, for fixed prior modes z.
//
//   P = p - L z - Phi f          penetration of every slave, mm
//   f_i = beta P_i where P_i > 0, else 0
//
// This is the condition of a strictly convex problem,
//   minimise 1/2 f (Phi + I / beta) f - (p - L z) f   over f >= 0,
// so that it has one solution, whatever the search began with. Slaves of a set that pull leave it
// and others that penetrate join it (primal-dual active sets: Hintermüller, Ito & Kunisch 2002,
// SIAM J. Optim. 13:865). That mostly settles within six sets. Where it does not, projected Newton
// steps follow (Bertsekas 1982, SIAM J. Control Optim. 20:221): the minimum over the slaves that
// are free to press, and where one of them would pull, a shorter step on the way there, so that the
// value always falls. Sets are solved for by ContactSystem. Nothing is allocated after
// construction, but for what that makes once.
#pragma once

#include <functional>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/skull/contact_system.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

// Depth that an open slave may have in a solution; no slave pulls. A millionth of the gap.
inline constexpr double kContactViolation_mm = 1e-6;

class ContactAtLoads {
 public:
  // contact: false keeps every slave open. Keeps references to all but the numbers.
  ContactAtLoads(const CondensedOperators& operators, ModeWindow window, double beta, bool contact,
                 ContactSystem& system, ThreadTeam& team);

  // The next search begins from these forces of these slaves, N; where they pull, from 0.
  void begin_from(const std::vector<int>& slaves, const Eigen::Ref<const VecX>& forces);
  // Solves for z from the last forces on, or from those of begin_from(). give_up: asked before
  // every set. false when it said so: there is no solution then until the next solve() or
  // return_to_kept(). kNotConverged after kMaxSets sets; errors of ContactSystem::take.
  Result<bool> solve(const VecX& z, const std::function<bool()>& give_up = {});
  // out += T^T felt with T of the present set (contact_system.hpp): what forces felt by data mean
  // for the modes. felt: one per active slave; out: r.
  Status add_adjoint(const Eigen::Ref<const VecX>& felt, VecX& out);
  // The next search begins from the empty set.
  void forget();
  // Remembers the present solution; returns to it without a search.
  void keep();
  void return_to_kept();

  const contact::ActiveSet& set() const { return set_; }
  int size() const { return static_cast<int>(active_.size()); }
  const std::vector<int>& active() const { return active_; }                  // slaves, ascending
  Eigen::Map<const VecX> forces() const { return {forces_.data(), size()}; }  // of active slaves, N
  const VecX& penetration() const { return penetration_; }                    // s, mm
  double violation_mm() const { return violation_mm_; }                       // largest one
  int sets() const { return sets_; }  // solved for by the last solve()

  static constexpr int kMaxSets = 500;
  // Sets before steps are projected.
  static constexpr int kPlainSets = 10;

 private:
  // The first set of a search from all_forces_.
  void begin_set();
  // The next set by what pulls and what penetrates in the solution of this one.
  void exchange();
  // The next set of projected steps, free to press: slaves that do, and those that are deeper.
  void follow(double deeper_mm);
  // all_forces_ and penetration_ a part `step` of the way from before_ to those of the set, without
  // forces that pull.
  void go(double step);
  double dual() const;

  const CondensedOperators& operators_;
  ModeWindow window_;
  double beta_;
  bool contact_;
  ContactSystem& system_;
  ThreadTeam& team_;
  contact::ActiveSet set_;
  std::vector<int> active_;
  VecX free_penetration_;             // p - L z
  VecX forces_, newton_penetration_;  // of the present set: of its slaves, N; s, mm
  VecX all_forces_, penetration_;     // s; the start of the next solve
  VecX before_, penetration_before_;  // s
  std::vector<int> corrected_;        // slaves that would pull; those without a force
  VecX correction_;                   // to their forces, N
  double violation_mm_ = 0.0;
  int sets_ = 0;
  struct Solution {
    contact::ActiveSet set;
    std::vector<int> active;
    VecX forces, penetration;
    double violation_mm = 0.0;
  };
  Solution kept_;
};

}  // namespace brainshift::inversion
