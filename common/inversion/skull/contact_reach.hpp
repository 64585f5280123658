// SPDX-License-Identifier: GPL-3.0-or-later
// ContactReach: how far the modes may move before the linear model of a set of active slaves is
// worth little, because contact has changed in many of them.
//
//   forces of the set   f(t) = f - t T dz                 an active slave opens where f_i(t) = 0
//   penetration         P(t) = P - t (L dz - Phi T dz)    an open one closes where P_i(t) = 0
//
// with T of contact_reduction.hpp. A step that ends where few slaves have changed finds contact
// with few sets and few updates of its factor; one that goes far beyond costs ten factorisations,
// and its end says nothing of the way. Nothing is allocated after construction.
#pragma once

#include "common/core/thread_team.hpp"
#include "common/inversion/skull/contact_reduction.hpp"
#include "common/inversion/skull/mode_window.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

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
  VecX crossings_;          // values of t
};

}  // namespace brainshift::inversion
