// SPDX-License-Identifier: GPL-3.0-or-later
// Forward problem with contact: K u = b subject to penalty contact, iterated until the active set
// repeats (paper section 2.4: trial and error from an empty set; Le Tallec 1994).
//
// Each iteration refactorises K_p for the current active set, solves, and takes the slaves that
// penetrate as the next set. For a fixed right-hand side this is a semi-smooth Newton method on
// the penalty equations. So a set that repeats is a solution: every active slave is pressed,
// every other one is open.
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

// stiffness: K (lower), with its factor, dofs and contact; load: 3 x n, N.
// Errors as StiffnessFactor and fem::checked_solve. At max_iterations there is no error: the
// result holds the last iterate, and `converged` is false.
Result<ContactSolution> solve_with_contact(const linalg::SymmetricMatrix& stiffness,
                                           const fem::StiffnessFactor& factor,
                                           const fem::DofMap& dofs, const PenaltyContact& contact,
                                           const Points& load,
                                           const ContactSolverOptions& options = {});

}  // namespace brainshift::contact
