// SPDX-License-Identifier: GPL-3.0-or-later
// ContactReduction: contact forces of a set A of active slaves as an affine function of the prior
// modes z.
//
//   D f = p_A - L_A z,   D = Phi_AA + I / beta        =>   f = f0 - T z,   [T f0] = D^-1 [L_A p_A]
// L = N^T U: s x r; p: initial penetration. Everything is kept while the set stays the same.
//
// A set that follows another one, B, from which few slaves Q leave and which few slaves a join,
// needs as many solutions instead of r + 1, with D of all slaves and X = [T f0]:
//
//   X = (X_B)_A + Y S,   Y = D_AA^-1 [D_AQ E_a],   S = [(X_B)_Q ; [L p]_a - D_aB X_B]
//
// Rows of A that B has not are 0 in (X_B)_A; E_a: unit columns.
// Memory for all slaves is reserved by the constructor; nothing is allocated afterwards.
#pragma once

#include <memory>
#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/skull/contact_system.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

class ContactReduction {
 public:
  // A set follows the one before by at most so many changes, and this part of its slaves.
  static constexpr int kMaxChanges = 96, kPart = 5;

  // Keeps references to the operators and to the system that it shares with ContactAtLoads.
  // The team shares the work.
  ContactReduction(const CondensedOperators& operators, ModeWindow window, ContactSystem& system,
                   ThreadTeam& team);

  // Errors of ContactSystem::take. set: one flag per slave, or empty for none.
  Status activate(const contact::ActiveSet& set);
  void forget() {
    set_.clear();
    active_.clear();
    left_.clear();
    joined_.clear();
  }
  int size() const { return static_cast<int>(active_.size()); }
  const std::vector<int>& active() const { return active_; }  // slaves, ascending
  const contact::ActiveSet& set() const { return set_; }
  // [T | f0], k x (r + 1)
  Eigen::Map<const Eigen::MatrixXd> response() const { return response_of(response_, size()); }

  // How the last activate() came from the set before: Q and a, ascending, Y (k x changes) and S
  // (changes x (r + 1)). No changes: it did not.
  int changes() const { return static_cast<int>(left_.size() + joined_.size()); }
  const std::vector<int>& left() const { return left_; }
  Eigen::Map<const Eigen::MatrixXd> change_columns() const {
    return {columns_.get(), size(), changes()};
  }
  auto change_sizes() const { return sizes_.topRows(changes()); }

  // f0 - T z, of the active slaves, N; those that pull are no solution. out: k.
  void forces_at(const VecX& z, Eigen::Ref<VecX> out) const;

  // D^-1 N_A^T U of the modes before the window (those a scene leaves out), k x window.first.
  // Allocates. Errors of ContactSystem::take.
  Result<Eigen::MatrixXd> response_before() const;
  // -L_g dg - L dz - Phi_:A df: change of every slave's penetration, mm, where the modes before the
  // window move by dg, those of the window by dz and the forces of the set by df, N. Allocates.
  VecX penetration_change(const VecX& dg, const VecX& dz, const VecX& df) const;

 private:
  Eigen::Map<const Eigen::MatrixXd> response_of(const Eigen::MatrixXd& storage, int size) const {
    return {storage.data(), size, window_.count + 1};
  }
  // left_ and joined_ for set_ after before_; false, and empty, when there are too many or none.
  bool list_changes();
  // response_ from before_response_.
  void follow();

  const CondensedOperators& operators_;
  ModeWindow window_;
  ContactSystem& system_;
  ThreadTeam& team_;
  contact::ActiveSet set_;
  std::vector<int> active_, before_, left_, joined_;
  // Of the set and of the one before. Storage; the first k x (r + 1) entries are used,
  // column-major.
  Eigen::MatrixXd response_, before_response_;
  std::unique_ptr<double[]> columns_;  // D_Ba, then Y
  Eigen::MatrixXd sizes_;              // S
};

// ContactReach: how far the modes may move before the linear model of a set of active slaves is
// worth little, because contact has changed in many of them.
//
//   forces of the set   f(t) = f - t T dz                 an active slave opens where f_i(t) = 0
//   penetration         P(t) = P - t (L dz - Phi T dz)    an open one closes where P_i(t) = 0
//
// with T of ContactReduction. A step that ends where few slaves have changed finds contact
// with few sets and few updates of its factor; one that goes far beyond costs ten factorisations,
// and its end says nothing of the way. Nothing is allocated after construction.
class ContactReach {
 public:
  // Keeps references to all but the numbers. beta: penalty, N/mm. contact: false keeps every slave
  // open, so that every step reaches its end.
  ContactReach(const CondensedOperators& operators, ModeWindow window, double beta, bool contact,
               const ContactReduction& reduction, ThreadTeam& team);

  // The largest t <= 1 at which at most `most` slaves have changed on the way z + t step; at least
  // kShortest. penetration: of every slave at z (ContactAtLoads::penetration()), mm; where contact
  // at z differs from the set of the linear model already, a slave does not count.
  double along(const VecX& step, const VecX& penetration, int most);

  static constexpr double kShortest = 1e-3;

 private:
  const CondensedOperators& operators_;
  ModeWindow window_;
  double beta_;
  bool contact_;
  const ContactReduction& reduction_;
  ThreadTeam& team_;
  VecX opening_, closing_;  // changes of force, N, and of penetration, mm
  VecX crossings_;          // values of t; before them forces of all slaves, N
};

}  // namespace brainshift::inversion
