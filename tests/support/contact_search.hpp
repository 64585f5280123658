// SPDX-License-Identifier: GPL-3.0-or-later
// The forward problem with contact, K u = b subject to penalty contact, as the paper solves it. The
// product's solvers are compared with it.
//
// The active set is iterated from the empty one until it repeats (paper section 2.4: trial and
// error; Le Tallec 1994). Each iteration refactorises K_p for the current set, solves, and takes
// the slaves that penetrate as the next set. For a fixed right-hand side this is a semi-smooth
// Newton method on the penalty equations. So a set that repeats is a solution: every active slave
// is pressed, every other one is open.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include "common/contact/forward_model.hpp"

namespace brainshift::test_support {

struct ContactSolution {
  Points displacement;  // 3 x n, mm
  contact::ActiveSet active;
  int iterations = 0;  // linear solves
  bool converged = false;
  double backward_error = 0.0;  // the largest of all solves
};

inline constexpr int kMaxContactIterations = 40;

// stiffness: K (lower), with its factor, dofs and contact; load: 3 x n, N.
// Errors as StiffnessFactor and fem::checked_solve. At kMaxContactIterations there is no error:
// the result holds the last iterate, and `converged` is false.
inline Result<ContactSolution> solve_with_contact(const linalg::SymmetricMatrix& stiffness,
                                                  const fem::StiffnessFactor& factor,
                                                  const fem::DofMap& dofs,
                                                  const contact::PenaltyContact& contact,
                                                  const Points& load) {
  ContactSolution solution;
  solution.active.assign(static_cast<std::size_t>(contact.num_slaves()), 0);
  fem::StiffnessFactor penalised = factor.clone_analysis();
  while (solution.iterations < kMaxContactIterations && !solution.converged) {
    VecX unknowns;
    Result<linalg::SolveQuality> quality;
    if (contact::count(solution.active) == 0) {
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
    contact::ActiveSet next = contact.penetrating(solution.displacement);
    solution.converged = next == solution.active;
    solution.active = std::move(next);
  }
  return solution;
}

// The same of a forward model; without slaves its solve().
inline Result<ContactSolution> solve_with_contact(const contact::ForwardModel& forward,
                                                  const Points& load) {
  return solve_with_contact(forward.stiffness(), forward.factor(), forward.dofs(),
                            forward.contact(), load);
}

}  // namespace brainshift::test_support
