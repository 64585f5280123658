// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/refactorised_system.hpp"

namespace brainshift::inversion {

RefactorisedSystem::RefactorisedSystem(const contact::ForwardModel& forward)
    : PenalisedSystem(forward), penalised_(forward.factor().clone_analysis()) {}

Status RefactorisedSystem::refresh() {
  if (contact::count(active()) == 0) return {};
  fem::SymmetricMatrix k_p = forward().stiffness();
  forward().contact().add_stiffness(k_p, forward().dofs(), active());
  return penalised_.refactorise(k_p);
}

Status RefactorisedSystem::solve(const Points& f, Points& u) const {
  const fem::StiffnessFactor& factor =
      contact::count(active()) > 0 ? penalised_ : forward().factor();
  u = forward().dofs().expand(factor.solve(forward().dofs().restrict_to(f)));
  return {};
}

}  // namespace brainshift::inversion
