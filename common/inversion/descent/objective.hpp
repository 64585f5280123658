// SPDX-License-Identifier: GPL-3.0-or-later
// What a descent on Omega (descents.hpp) needs of it for the active set of a system: its
// negative gradient by the adjoint, and the step that minimises it along a direction s = Sigma dw.
//
//   K_p lambda = 2 A^T W_e e        (paper eq. 5)
//   -g = lambda - 2 W_b b           (paper eq. 6)
//   alpha = (e . W_e A z - b . W_b s) / (A z . W_e A z + s . W_b s),     z = K_p^-1 s,  W_b s = dw
#pragma once

#include "common/contact/penalised_system.hpp"
#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/fem/sampling.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// d, A and W_e of one inversion (paper eq. 4): misfit e = d - A u and its weighted products.
//
//   W_e = diag(1 / sd^2), one standard deviation per datum, the same for its three components
// Shapes: u is 3 x n (mm); residuals and samples are 3 x m (mm); adjoint() is 3 x n.
class Misfit {
 public:
  // Errors as fem::sampling_matrix: a datum outside the brain by more than kOutsideTolerance_mm.
  // Keeps a reference to `data`.
  static Result<Misfit> build(const PreparedModel& model, const SparseData& data);

  // A u
  Points sample(const Points& u) const;
  // d - A u
  Points residual(const Points& u) const;
  // A^T W_e r
  Points adjoint(const Points& r) const;
  // r . W_e s
  double inner(const Points& r, const Points& s) const;

 private:
  Misfit(const SparseData& data, const fem::SamplingMatrix& sampling);
  const SparseData& data_;
  fem::SamplingMatrix sampling_;
  VecX weights_;
};

// sum of a_ij b_ij
double inner(const Points& a, const Points& b);

// e: misfit d - A u, 3 x m; w = W_b b: 3 x n. lambda: 3 x n, the first guess of an iterative
// system. Overwrites lambda and the negative gradient, 3 x n in RAS axes. Errors as the system's.
Status negative_gradient(contact::PenalisedSystem& system, const Misfit& misfit, const Points& e,
                         const Points& w, Points& lambda, Points& gradient);

// e: misfit, az = A z: 3 x m; b, s, dw: 3 x n. 0 when the curvature along s is 0, which it is at
// the minimum, where the direction is zero. kNotFinite when the curvature is not a number.
Result<double> exact_step(const Misfit& misfit, const Points& e, const Points& az, const Points& b,
                          const Points& s, const Points& dw);

}  // namespace brainshift::inversion
