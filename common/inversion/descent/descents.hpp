// SPDX-License-Identifier: GPL-3.0-or-later
// The paper's inversion: adjoint steepest descent with one contact iteration per step (section
// 2.2-2.4, Fig. 2).
//
// Minimises, over the forcing b,
//   Omega(b) = (d - A u)^T W_e (d - A u) + b^T W_b b,      K_p u = b_p                     (eq. 4)
// with W_e = diag(1 / sd^2) and Sigma = W_b^-1 from prior/force_prior.hpp. Iteration k:
//   1. forward     u = K_p^-1 b_p with the active set of the step before (none at first)
//   2. contact     slaves that penetrate form the new active set; if it changed, K_p = K + Q^T beta
//                  Q is renewed and u = K_p^-1 b_p solved again (eq. 16): one contact iteration per
//                  step
//   3. misfit      e = d - A u; stop if mean_i |e_i^k - e_i^{k-1}| < 0.001 mean_i |e_i^1| (eq. 17)
//   4. adjoint     K_p lambda = 2 A^T W_e e                                                (eq. 5)
//   5. gradient    g = 2 W_b b - lambda (eq. 6); direction -Sigma g = Sigma lambda - 2 b
//   6. line search exact for the active set: one more solve z = K_p^-1 s,
//                  alpha = (e . W_e A z - b . W_b s) / (A z . W_e A z + s . W_b s)
// b is carried as Sigma w, so W_b is never formed: w = W_b b, and s = Sigma dw with dw = lambda - 2
// w. Starts from b = 0: nothing about the surgery is assumed but what the prior states.
#pragma once

#include "common/contact/penalised_system.hpp"
#include "common/core/error.hpp"
#include "common/inversion/contract/inversion_options.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// system: of model.forward(), no slave active; the paper's is a RefactorisedSystem.
// Preconditions: check_data(data) and check_whole(data) are ok. Errors as the system's, as
// Misfit::build, and stopped().
Result<Estimate> steepest_descent(const PreparedModel& model, const SparseData& data,
                                  const InversionOptions& options,
                                  contact::PenalisedSystem& system);

// The paper's inversion with conjugate gradients in place of steepest descent: same objective
// Omega, prior, penalty contact and stop rule as steepest_descent().
//
// For a fixed active set Omega is quadratic in b. Sigma, which is about the inverse of its Hessian
// where there are no data, preconditions it. With the negative gradient r = lambda - 2 w and b =
// Sigma w:
//   direction     dw = r + gamma dw',  s = Sigma dw = Sigma r + gamma s'   ('): iteration before
//                 gamma = r . Sigma (r - r') / r' . Sigma r', at least 0   (Polak & Ribiere 1969)
//   line search   exact for the active set, z = K_p^-1 s
//   step          w += alpha dw,  b += alpha s,  u += alpha z       (u = K_p^-1 b_p still holds)
//   contact       one contact iteration; where the active set changed, Omega did, so gamma = 0 next
// Two solves per iteration, and a third when the set changes.
//
// As steepest_descent(); the solutions before are the first guesses of an iterative system.
Result<Estimate> conjugate_gradients(const PreparedModel& model, const SparseData& data,
                                     const InversionOptions& options,
                                     contact::PenalisedSystem& system);

}  // namespace brainshift::inversion
