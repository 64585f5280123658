// SPDX-License-Identifier: GPL-3.0-or-later
// Forward problem with contact: K u = b subject to penalty contact, iterated until the active set repeats
// (paper section 2.4: trial and error from an empty set; Le Tallec 1994).
//
// Each iteration: refactorise K_p for the current active set, solve, and take the slaves that penetrate as the
// next set. For a fixed right-hand side this is a semi-smooth Newton method on the penalty equations, so a set
// that repeats is a solution: every active slave is pressed, every other one is open.
#pragma once

#include <vector>

#include "common/contact/penalty.hpp"
#include "common/core/error.hpp"
#include "common/fem/stiffness_factor.hpp"

namespace brainshift::contact {

struct ContactSolution {
  Points displacement;  // 3 x n, mm
  ActiveSet active;
  int iterations = 0;  // linear solves
  bool converged = false;
  double backward_error = 0.0;  // the largest of all solves
};

struct ContactSolverOptions {
  int max_iterations = 40;
};

// stiffness: K (lower), dofs and contact as prepared; load: 3 x n, N.
// Fails as StiffnessFactor and fem::checked_solve do; kNotConverged only by converged == false in the result (best
// iterate kept).
Result<ContactSolution> solve_with_contact(const linalg::SymmetricMatrix& stiffness,
                                           const fem::StiffnessFactor& factor,
                                           const fem::DofMap& dofs, const PenaltyContact& contact,
                                           const Points& load,
                                           const ContactSolverOptions& options = {});

}  // namespace brainshift::contact
