// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/quasi_newton.hpp"

namespace brainshift::inversion {
namespace {

// Of |s| |y|.
constexpr double kLeastCurvature = 1e-8;

}  // namespace

QuasiNewton::QuasiNewton(Eigen::Index size)
    : inverse_(Eigen::MatrixXd::Identity(size, size)), product_(size) {}

// M + (1 + y M y / s y) s s^T / s y - (M y s^T + s y^T M) / s y
bool QuasiNewton::learn(const VecX& step, const VecX& change_of_gradient) {
  const double curvature = step.dot(change_of_gradient);
  if (!(curvature > kLeastCurvature * step.norm() * change_of_gradient.norm())) return false;
  apply(change_of_gradient, product_);
  const double scale = (1.0 + change_of_gradient.dot(product_) / curvature) / curvature;
  const Eigen::Index size = step.size();
  for (Eigen::Index j = 0; j < size; ++j) {
    inverse_.col(j).tail(size - j) +=
        (scale * step[j] - product_[j] / curvature) * step.tail(size - j) -
        (step[j] / curvature) * product_.tail(size - j);
  }
  return true;
}

void QuasiNewton::apply(const VecX& v, VecX& out) const {
  out.noalias() = inverse_.selfadjointView<Eigen::Lower>() * v;
}

}  // namespace brainshift::inversion
