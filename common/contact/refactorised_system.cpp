// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/refactorised_system.hpp"

#include "common/fem/stiffness_factor.hpp"

namespace brainshift::contact {

RefactorisedSystem::RefactorisedSystem(const ForwardModel& forward)
    : PenalisedSystem(forward), penalised_(forward.factor().clone_analysis()) {}

Status RefactorisedSystem::refresh() {
  if (count(active()) == 0) return {};
  matrix_ = forward().stiffness();
  forward().contact().add_stiffness(matrix_, forward().dofs(), active());
  norm_ = linalg::max_norm(matrix_);
  return penalised_.refactorise(matrix_);
}

Status RefactorisedSystem::solve(const Points& f, Points& u) const {
  if (count(active()) == 0) return forward().solve(f, u);
  VecX unknowns;
  const auto quality =
      fem::checked_solve(matrix_, norm_, penalised_, forward().dofs().restrict_to(f), unknowns);
  if (!quality) return tl::unexpected(quality.error());
  forward().dofs().expand(unknowns, u);
  return {};
}

}  // namespace brainshift::contact
