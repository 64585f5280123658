// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/contact_solver.hpp"

#include <algorithm>

#include "common/fem/stiffness_factor.hpp"

namespace brainshift::contact {

Result<ContactSolution> solve_with_contact(const linalg::SymmetricMatrix& stiffness,
                                           const fem::StiffnessFactor& factor,
                                           const fem::DofMap& dofs, const PenaltyContact& contact,
                                           const Points& load,
                                           const ContactSolverOptions& options) {
  ContactSolution solution;
  solution.active.assign(static_cast<std::size_t>(contact.num_slaves()), 0);
  fem::StiffnessFactor penalised = factor.clone_analysis();
  while (solution.iterations < options.max_iterations && !solution.converged) {
    VecX unknowns;
    Result<linalg::SolveQuality> quality;
    if (count(solution.active) == 0) {
      quality = fem::checked_solve(stiffness, linalg::max_norm(stiffness), factor,
                                   dofs.restrict_to(load), unknowns);
    } else {
      linalg::SymmetricMatrix k_p = stiffness;
      contact.add_stiffness(k_p, dofs, solution.active);
      Points b_p = load;
      contact.add_load(b_p, solution.active);
      if (auto status = penalised.refactorise(k_p); !status) return tl::unexpected(status.error());
      quality = fem::checked_solve(k_p, linalg::max_norm(k_p), penalised, dofs.restrict_to(b_p),
                                   unknowns);
    }
    if (!quality) return tl::unexpected(quality.error());
    solution.backward_error = std::max(solution.backward_error, quality->backward_error);
    dofs.expand(unknowns, solution.displacement);
    ++solution.iterations;
    ActiveSet next = contact.penetrating(solution.displacement);
    solution.converged = next == solution.active;
    solution.active = std::move(next);
  }
  return solution;
}

}  // namespace brainshift::contact
