// SPDX-License-Identifier: GPL-3.0-or-later
// The paper's inversion with conjugate gradients in place of steepest descent: same objective
// Omega, prior, penalty contact and stop rule as steepest_descent.hpp.
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
#pragma once

#include "common/contact/penalised_system.hpp"
#include "common/core/error.hpp"
#include "common/inversion/contract/inversion_options.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// As steepest_descent(); the solutions before are the first guesses of an iterative system.
Result<Estimate> conjugate_gradients(const PreparedModel& model, const SparseData& data,
                                     const InversionOptions& options,
                                     contact::PenalisedSystem& system);

}  // namespace brainshift::inversion
