// SPDX-License-Identifier: GPL-3.0-or-later
// ContactReduction: contact forces of a set A of active slaves as an affine function of the prior
// modes z.
//
//   D f = p_A - L_A z,   D = Phi_AA + I / beta        =>   f = f0 - T z,   [T f0] = D^-1 [L_A p_A]
// L = N^T U: s x r; p: initial penetration. Everything is kept while the set stays the same.
// Memory for all slaves is reserved by the constructor; nothing is allocated afterwards.
#pragma once

#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/error.hpp"
#include "common/inversion/skull/contact_system.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

class ContactReduction {
 public:
  // Keeps references to the operators and to the system that it shares with ContactAtLoads.
  ContactReduction(const CondensedOperators& operators, ModeWindow window, ContactSystem& system);

  // Errors of ContactSystem::take. set: one flag per slave, or empty for none.
  Status activate(const contact::ActiveSet& set);
  void forget() {
    set_.clear();
    active_.clear();
  }
  int size() const { return static_cast<int>(active_.size()); }
  const std::vector<int>& active() const { return active_; }  // slaves, ascending
  const contact::ActiveSet& set() const { return set_; }
  // [T | f0], k x (r + 1)
  Eigen::Map<const Eigen::MatrixXd> response() const {
    return {response_.data(), size(), window_.count + 1};
  }

  // f0 - T z, of the active slaves, N; those that pull are no solution. out: k.
  void forces_at(const VecX& z, Eigen::Ref<VecX> out) const;

  // D^-1 N_A^T U of the modes before the window (those a scene leaves out), k x window.first.
  // Allocates. Errors of ContactSystem::take.
  Result<Eigen::MatrixXd> response_before() const;
  // -L_g dg - L dz - Phi_:A df: change of every slave's penetration, mm, where the modes before the
  // window move by dg, those of the window by dz and the forces of the set by df, N. Allocates.
  VecX penetration_change(const VecX& dg, const VecX& dz, const VecX& df) const;

 private:
  const CondensedOperators& operators_;
  ModeWindow window_;
  ContactSystem& system_;
  contact::ActiveSet set_;
  std::vector<int> active_;
  Eigen::MatrixXd response_;  // storage; the first k x (r + 1) entries are used, column-major
};

}  // namespace brainshift::inversion
