// SPDX-License-Identifier: GPL-3.0-or-later
// ContactAtLoads: the contact forces f for fixed loads, that is, for fixed prior modes z.
//
//   P = p - L z - Phi f          penetration of every slave, mm
//   f_i = beta P_i where P_i > 0, else 0
//
// This is the condition of a strictly convex problem,
//   minimise 1/2 f (Phi + I / beta) f - (p - L z) f   over f >= 0,
// so that it has one solution, whatever the search began with. Projected Newton steps (Bertsekas
// 1982, SIAM J. Control Optim. 20:221): the minimum over the slaves that are free to press, and
// where one of them would pull, a shorter step on the way there, so that the value always falls.
// Sets are solved for by ContactFactor. Nothing is allocated after construction.
#pragma once

#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/skull/contact_factor.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/linalg/growing_matrix.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

// Depth that an open slave may have in a solution; no slave pulls. A millionth of the gap.
inline constexpr double kContactViolation_mm = 1e-6;

class ContactAtLoads {
 public:
  // contact: false keeps every slave open. Keeps references to all but the numbers.
  ContactAtLoads(const CondensedOperators& operators, ModeWindow window, double beta, bool contact,
                 ContactFactor& factor, ThreadTeam& team);

  // The next search begins from these forces of these slaves, N; where they pull, from 0.
  void begin_from(const std::vector<int>& slaves, const Eigen::Ref<const VecX>& forces);
  // Solves for z from the last forces on, or from those of begin_from(). kNotConverged after
  // kMaxSets sets; errors of ContactFactor::take.
  Status solve(const VecX& z);
  // out += T^T felt with T = D^-1 L_A of the present set (contact_reduction.hpp): what forces felt
  // by data mean for the modes. felt: one per active slave; out: r.
  Status add_adjoint(const Eigen::Ref<const VecX>& felt, VecX& out);
  // The next search begins from the empty set.
  void forget();

  const contact::ActiveSet& set() const { return set_; }
  int size() const { return static_cast<int>(active_.size()); }
  const std::vector<int>& active() const { return active_; }                  // slaves, ascending
  Eigen::Map<const VecX> forces() const { return {forces_.data(), size()}; }  // of active slaves, N
  const VecX& penetration() const { return penetration_; }                    // s, mm
  double violation_mm() const { return violation_mm_; }                       // largest one
  int sets() const { return sets_; }  // solved for by the last solve()

  static constexpr int kMaxSets = 500;

 private:
  Status solve_forces();
  void update_penetration();
  double dual() const;

  const CondensedOperators& operators_;
  ModeWindow window_;
  double beta_;
  bool contact_;
  ContactFactor& factor_;
  ThreadTeam& team_;
  contact::ActiveSet set_;
  std::vector<int> active_;
  VecX free_penetration_;                            // p - L z
  VecX forces_, all_forces_, before_, penetration_;  // all_forces_: s, start of the next solve
  double violation_mm_ = 0.0;
  int sets_ = 0;
  linalg::GrowingVector adjoint_;
  VecX work_;
};

}  // namespace brainshift::inversion
