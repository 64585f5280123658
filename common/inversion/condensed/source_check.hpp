// SPDX-License-Identifier: GPL-3.0-or-later
// Does a source of data agree with what the other sources and the prior predict for it?
//
// Unknowns x of a linear model with prior information P0 (diagonal). Source s contributes
// G_s = J^T R^-1 J and b_s = J^T R^-1 d. The others know x to
// (P0 + sum_{t != s} G_t)^-1 = (L L^T)^-1 about their mean m. The score of the source there, in
// units of what the others know,
//   y = L^-1 (b_s - G_s m)      has covariance   S = M + M^2,   M = L^-1 G_s L^-T
// when the model is right. Directions that the source hardly sees are damped instead of cut off:
//   T = y^T (S + d I)^-1 y,   E T = tr A S,   var T = 2 tr (A S)^2,   A = (S + d I)^-1
// T is compared with the scaled chi-square of that mean and variance (Satterthwaite 1946). Only
// what the source can say about x enters, so the many rows that are noise to everyone do not dilute
// the test.
#pragma once

#include "common/core/types.hpp"
#include "common/linalg/blas.hpp"

namespace brainshift::inversion {

struct Consistency {
  double chi_square = 0.0;          // scaled to degrees_of_freedom
  double degrees_of_freedom = 0.0;  // not an integer
  double p_value = 1.0;             // of a larger chi_square by chance
};

// Keeps its workspace from call to call.
class SourceCheck {
 public:
  // gram, right: of all sources; own_gram, own_right: of the source; lower triangles, without the
  // prior. prior: diagonal of P0, > 0. False when the others' normal equations are not positive
  // definite.
  [[nodiscard]] bool run(const linalg::blas::In<double>& gram, const Eigen::Ref<const VecX>& right,
                         const linalg::blas::In<double>& own_gram,
                         const Eigen::Ref<const VecX>& own_right,
                         const Eigen::Ref<const VecX>& prior, Consistency& out);

 private:
  Eigen::MatrixXd factor_, whitened_, score_covariance_, inverse_;
  VecX mean_, score_;
};

}  // namespace brainshift::inversion
