// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/pose_ascent.hpp"

#include <algorithm>

namespace brainshift::registration {
namespace {

constexpr double kArmijo = 1e-4;
constexpr int kMostHalvings = 12;

// Updates the inverse Hessian of -f: s the step taken, y the change of the gradient of -f.
void bfgs_update(Mat6& H, const Vec6& s, const Vec6& y, bool first) {
  const double sy = s.dot(y);
  if (!(sy > 1e-10 * s.norm() * y.norm())) return;  // f is not concave along the step
  if (first) H = (sy / y.squaredNorm()) * Mat6::Identity();
  const Mat6 left = Mat6::Identity() - s * y.transpose() / sy;
  H = (left * H * left.transpose() + s * s.transpose() / sy).eval();
}

}  // namespace

PoseAscent ascend(const PoseFunction& function, const RigidTransform& T_initial, const Vec3& centre,
                  double radius_mm, const PoseAscentOptions& options) {
  Vec6 scale;  // xi = scale * z
  scale << Vec3::Constant(1.0 / radius_mm), Vec3::Ones();
  PoseAscent result;
  result.T = T_initial;
  PoseValue here = function(result.T, result.T * centre);
  result.evaluations = 1;
  result.valid = here.valid;
  result.value = here.value;
  if (!here.valid) return result;

  Vec6 g = scale.cwiseProduct(here.gradient);
  bool fresh = true;  // H holds no curvature yet
  Mat6 H = Mat6::Identity();
  for (; result.iterations < options.max_iterations && !result.converged; ++result.iterations) {
    if (!(g.norm() > 0.0)) {
      result.converged = true;
      break;
    }
    if (fresh) H = options.first_step_mm / g.norm() * Mat6::Identity();
    Vec6 step = H * g;
    step *= std::min(1.0, options.largest_step_mm / step.norm());
    PoseValue next;
    RigidTransform T_next;
    bool uphill = false;
    for (int halving = 0; halving < kMostHalvings && !uphill; ++halving) {
      if (halving > 0) step *= 0.5;
      T_next = rigid_increment(scale.cwiseProduct(step), result.T * centre) * result.T;
      next = function(T_next, T_next * centre);
      ++result.evaluations;
      uphill = next.valid && next.value >= result.value + kArmijo * g.dot(step);
      if (step.norm() < options.tolerance_mm) break;
    }
    if (!uphill) {
      result.converged = fresh;  // not even along the gradient
      fresh = true;
      continue;
    }
    const Vec6 g_next = scale.cwiseProduct(next.gradient);
    bfgs_update(H, step, g - g_next, fresh);
    fresh = false;
    result.T = T_next;
    result.value = next.value;
    g = g_next;
    result.converged = step.norm() < options.tolerance_mm;
  }
  return result;
}

}  // namespace brainshift::registration
