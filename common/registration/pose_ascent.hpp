// SPDX-License-Identifier: GPL-3.0-or-later
// The rigid motion near a first one at which a smooth function is greatest, by the quasi-Newton
// method BFGS.
//
//   z = (radius w, t), xi = (w, t): all six in mm;  T <- rigid_increment(xi, c) T,  c = T centre
//   step p = H g, H the inverse-Hessian estimate (BFGS, H = scaled identity at first), halved
//   until f(T(p)) >= f(T) + 1e-4 g . p                                                 (Armijo)
// Gradients of successive poses are compared as if their tangent spaces were the same. They differ
// by half a step's angle.
// Source: Nocedal & Wright, Numerical Optimization (2006), algorithm 6.1.
#pragma once

#include <functional>

#include "common/registration/rigid_increment.hpp"

namespace brainshift::registration {

struct PoseValue {
  // False outside of the function's domain. Such a pose is never taken.
  bool valid = false;
  double value = 0.0;
  Vec6 gradient = Vec6::Zero();  // by xi about the given centre, per radian and per mm
};
using PoseFunction = std::function<PoseValue(const RigidTransform& T, const Vec3& centre)>;

struct PoseAscentOptions {
  int max_iterations = 60;
  double first_step_mm = 1.0;
  // About the size of what the function resolves, so that no step jumps over a hill.
  double largest_step_mm = 3.0;
  double tolerance_mm = 0.01;  // converged when a step is shorter
};

struct PoseAscent {
  RigidTransform T = RigidTransform::Identity();
  double value = 0.0;
  int iterations = 0;
  int evaluations = 0;
  bool valid = false;      // the function is defined at the first pose
  bool converged = false;  // a step was below the tolerance, or no step went up
};

// centre: of the moved points, in their own frame, mm. radius_mm > 0: their rms distance from it.
PoseAscent ascend(const PoseFunction& function, const RigidTransform& T_initial, const Vec3& centre,
                  double radius_mm, const PoseAscentOptions& options = {});

}  // namespace brainshift::registration
