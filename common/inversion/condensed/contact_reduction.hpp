// SPDX-License-Identifier: GPL-3.0-or-later
// ContactReduction: contact forces of a set A of active slaves as an affine function of the prior
// modes z.
//
//   D f = p_A - L_A z,   D = Phi_AA + I / beta        =>   f = f0 - T z,   [T f0] = D^-1 [L_A p_A]
//   penetration          P = p - L z - Phi_:A f       of every slave, mm; f / beta for active ones
// L = N^T U: s x r; p: initial penetration; D is symmetric positive definite. Everything is kept
// while the set stays the same. D is factorised anew when it changes: k^3/3 flops, a few
// milliseconds for 600 slaves, less than the rest of an update; low-rank updates of the factor
// would not pay (docs/decisions/0008). Memory for all slaves is reserved by the constructor;
// nothing is allocated afterwards.
#pragma once

#include <memory>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/condensed/mode_window.hpp"
#include "common/values/condensed_operators.hpp"

namespace brainshift::inversion {

class ContactReduction {
 public:
  // Keeps references to the operators and to the team that shares the work. beta: penalty, N/mm.
  ContactReduction(const CondensedOperators& operators, ModeWindow window, double beta,
                   ThreadTeam& team);

  // kSingularMatrix when D cannot be factorised. set: one flag per slave, or empty for none.
  Status activate(const contact::ActiveSet& set);
  int size() const { return static_cast<int>(active_.size()); }
  const std::vector<int>& active() const { return active_; }  // slaves, ascending
  // [T | f0], k x (r + 1)
  Eigen::Map<const Eigen::MatrixXd> response() const {
    return {response_.data(), size(), window_.count + 1};
  }

  // D^-1 N_A^T U of the modes before the window (those a scene leaves out), k x window.first.
  // Allocates.
  Eigen::MatrixXd response_before() const;

  // f and P for the given z.
  void update_forces(const VecX& z);
  Eigen::Map<const VecX> forces() const { return {forces_.data(), size()}; }  // of active slaves, N
  const VecX& all_forces() const { return all_forces_; }                      // s, N; 0 when open
  const VecX& penetration() const { return penetration_; }                    // s, mm
  const VecX& compliance_diagonal() const { return diagonal_; }               // s, mm/N

 private:
  const CondensedOperators& operators_;
  ModeWindow window_;
  double beta_;
  ThreadTeam& team_;
  contact::ActiveSet set_;
  std::vector<int> active_;
  // Uninitialised: the system hands out memory when it is first used.
  std::unique_ptr<double[]> factor_storage_;
  Eigen::MatrixXd response_;  // storage; the first k x (r + 1) entries are used, column-major
  VecX forces_, all_forces_, penetration_, diagonal_;
};

}  // namespace brainshift::inversion
