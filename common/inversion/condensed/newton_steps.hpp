// SPDX-License-Identifier: GPL-3.0-or-later
// NewtonBundle: the next step of a descent on a function with edges (load_descent.hpp), from what
// is known of its pieces.
//
// Lengths are such that the second derivative of every piece is taken for the identity. A piece
// that was met is kept as it looks from the present point: its Newton step s_i (from the point to
// the piece's own minimum) and how far it lies below the function there, gap_i >= 0. The model
//
//   m(d) = value + max_i (-gap_i - s_i d) + 1/2 |d|^2
//
// has its minimum at d = sum a_i s_i, where a >= 0, sum a = 1 minimises
//   fall(a) = 1/2 |sum a_i s_i|^2 + sum a_i gap_i,   which is value - min m.
// (Level bundle with a fixed metric: Hiriart-Urruty & Lemarechal 1993, Convex Analysis and
// Minimization Algorithms II, XV.3.) On the edge where two pieces meet, the model's minimum is the
// edge's, where no Newton step of either piece falls. Nothing is allocated after construction.
#pragma once

#include "common/core/types.hpp"

namespace brainshift::inversion {

class NewtonBundle {
 public:
  static constexpr int kMax = 24;

  // size: of a step.
  explicit NewtonBundle(Eigen::Index size);
  void clear() { count_ = 0; }
  int count() const { return count_; }
  // A piece that was met at the point: its Newton step from there.
  void add_here(const VecX& newton_step);
  // A piece that was met at a trial, `away` from the point, where the function is higher by `rise`:
  // its Newton step from there. False for a piece that lies above the function at the point by more
  // than rounding: its curvature is not the identity's, it is not kept, and a shorter step is to
  // meet it nearer.
  [[nodiscard]] bool add_at(const VecX& away, double rise, const VecX& newton_step);
  // The point moves by d, and the function is lower by `fall` there. Pieces that then seem to lie
  // above the function are dropped.
  void move(const VecX& d, double fall);

  // The minimum of the model, and what it promises. Precondition: count() > 0.
  void solve();
  const VecX& step() const { return step_; }
  double fall() const { return fall_; }

 private:
  void add(const VecX& newton_step, double gap);

  int count_ = 0;
  Eigen::MatrixXd steps_;                       // size x kMax
  Eigen::Matrix<double, kMax, kMax> products_;  // s_i . s_j
  Eigen::Matrix<double, kMax, 1> gaps_, weights_, slopes_;
  VecX step_;
  double fall_ = 0.0;
};

// QuasiNewton: an estimate of the inverse second derivative that learns from gradients (BFGS;
// Nocedal & Wright 2006, Numerical Optimization, section 6.1; on functions with edges Lewis &
// Overton 2013, Math. Program. 141:135).
//
// Coordinates are such that the second derivative is about the identity, where it begins. Every
// pair of points p, p + s with gradients g, g + y corrects it to M with M y = s. Pairs without
// curvature, s y <= 0, are left out, so that M stays positive definite. Nothing is allocated after
// construction.
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
