// SPDX-License-Identifier: GPL-3.0-or-later
// The step that minimises Omega (steepest_descent.hpp) along a direction s = Sigma dw, exact for a
// fixed active set:
//
//   alpha = (e . W_e A z - b . W_b s) / (A z . W_e A z + s . W_b s),     z = K_p^-1 s,  W_b s = dw
#pragma once

#include "common/core/error.hpp"
#include "common/inversion/descent/misfit.hpp"

namespace brainshift::inversion {

// sum of a_ij b_ij
double inner(const Points& a, const Points& b);

// e: misfit, az = A z: 3 x m; b, s, dw: 3 x n. 0 when the curvature along s is 0, which it is at
// the minimum, where the direction is zero. kNotFinite when the curvature is not a number.
Result<double> exact_step(const Misfit& misfit, const Points& e, const Points& az, const Points& b,
                          const Points& s, const Points& dw);

}  // namespace brainshift::inversion
