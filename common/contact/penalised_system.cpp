// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/penalised_system.hpp"

#include "common/fem/stiffness_factor.hpp"

namespace brainshift::contact {

PenalisedSystem::PenalisedSystem(const ForwardModel& forward)
    : forward_(forward), active_(static_cast<std::size_t>(forward.contact().num_slaves()), 0) {}

Status PenalisedSystem::activate(const ActiveSet& active) {
  if (active == active_) return {};
  active_ = active;
  if (count(active_) > 0) ++changes_;
  return refresh();
}

Status PenalisedSystem::solve_with_gaps(const Points& b, Points& u) const {
  Points b_p = b;
  forward_.contact().add_load(b_p, active_);
  return solve(b_p, u);
}

Result<bool> PenalisedSystem::follow_contact(const Points& b, Points& u) {
  const ActiveSet penetrating = forward_.contact().penetrating(u);
  if (penetrating == active_) return false;
  if (auto status = activate(penetrating); !status) return tl::unexpected(status.error());
  if (auto status = solve_with_gaps(b, u); !status) return tl::unexpected(status.error());
  return true;
}

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
