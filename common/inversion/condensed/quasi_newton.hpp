// SPDX-License-Identifier: GPL-3.0-or-later
// QuasiNewton: an estimate of the inverse second derivative that learns from gradients (BFGS;
// Nocedal & Wright 2006, Numerical Optimization, section 6.1; on functions with edges Lewis &
// Overton 2013, Math. Program. 141:135).
//
// Coordinates are such that the second derivative is about the identity, where it begins. Every
// pair of points p, p + s with gradients g, g + y corrects it to M with M y = s. Pairs without
// curvature, s y <= 0, are left out, so that M stays positive definite. Nothing is allocated after
// construction.
#pragma once

#include "common/core/types.hpp"

namespace brainshift::inversion {

class QuasiNewton {
 public:
  explicit QuasiNewton(Eigen::Index size);
  void reset() { inverse_.setIdentity(); }
  // s and y; false when the pair is left out.
  bool learn(const VecX& step, const VecX& change_of_gradient);
  // M v
  void apply(const VecX& v, VecX& out) const;

 private:
  Eigen::MatrixXd inverse_;  // M, lower triangle
  VecX product_;
};

}  // namespace brainshift::inversion
