// SPDX-License-Identifier: GPL-3.0-or-later
// The negative gradient of Omega (steepest_descent.hpp) for the active set of a system, by the
// adjoint:
//
//   K_p lambda = 2 A^T W_e e        (paper eq. 5)
//   -g = lambda - 2 W_b b           (paper eq. 6)
#pragma once

#include "common/contact/penalised_system.hpp"
#include "common/core/error.hpp"
#include "common/inversion/descent/misfit.hpp"

namespace brainshift::inversion {

// e: misfit d - A u, 3 x m; w = W_b b: 3 x n. lambda: 3 x n, the first guess of an iterative
// system. Overwrites lambda and the negative gradient, 3 x n in RAS axes. Errors as the system's.
Status negative_gradient(contact::PenalisedSystem& system, const Misfit& misfit, const Points& e,
                         const Points& w, Points& lambda, Points& gradient);

}  // namespace brainshift::inversion
