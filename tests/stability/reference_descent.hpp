// SPDX-License-Identifier: GPL-3.0-or-later
// The paper's descent methods once more, from its equations, in long double and on the
// reference's own matrices: where the same rule of steps and stop leads without rounding.
//
//   minimise   (d - A u)^T R^-1 (d - A u) + b^T Sigma^-1 b,   K_p u = b_p,   b = Sigma w    (eq. 4)
//   gradient   2 w - lambda,   K_p lambda = 2 A^T R^-1 (d - A u)                         (eq. 5, 6)
//   step       exact for the set at hand
//   contact    once per step the slaves with P > 0 become the set, and u is solved again  (eq. 16)
//   stop       the residual changes by less than relative_misfit_change of the data, on average
//              (eq. 17), or max_iterations
// K_p^-1 is applied as a low-rank correction of K^-1, where the product's method `paper`
// factorises.
#pragma once

#include "tests/stability/reference_posterior.hpp"

namespace brainshift::stability {

struct Descent {
  VectorR displacement;  // 3n
  VectorR penetration;   // of every slave
  contact::ActiveSet active;
  Real mean_misfit_mm = 0;
  int iterations = 0;
  bool converged = false;
};

enum class Steps {
  kSteepest,   // along the negative gradient
  kConjugate,  // Polak and Ribiere, not below 0; begun anew where the set changes
};

// Nothing when a factor fails.
std::optional<Descent> descend(const ReferencePatient& patient, const SparseData& data,
                               const InversionConfig& config, Steps steps);

}  // namespace brainshift::stability
