// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/newton_steps.hpp"

#include <algorithm>
#include <cmath>

namespace brainshift::inversion {
namespace {

constexpr int kMaxIterations = 20000;
// Of the fall that is promised.
constexpr double kTolerance = 1e-6;
// Of the terms whose sum says where a piece lies.
constexpr double kRounding = 1e-9;

// Of |s| |y|.
constexpr double kMinCurvature = 1e-8;

}  // namespace

NewtonBundle::NewtonBundle(Eigen::Index size) : steps_(size, kMax), step_(size) {}

void NewtonBundle::add(const VecX& newton_step, double gap) {
  if (count_ == kMax) {  // the piece that counts least makes room
    int least = 0;
    for (int i = 1; i < count_; ++i) {
      if (weights_[i] < weights_[least] ||
          (weights_[i] == weights_[least] && gaps_[i] > gaps_[least])) {
        least = i;
      }
    }
    --count_;
    steps_.col(least) = steps_.col(count_);
    gaps_[least] = gaps_[count_];
    weights_[least] = weights_[count_];
  }
  steps_.col(count_) = newton_step;
  gaps_[count_] = gap;
  weights_[count_] = 0.0;
  ++count_;
}

void NewtonBundle::add_here(const VecX& newton_step) { add(newton_step, 0.0); }

bool NewtonBundle::add_at(const VecX& away, double rise, const VecX& newton_step) {
  // q(d) = value + rise - s (d - away) + 1/2 |d - away|^2
  const double along = newton_step.dot(away), squared = 0.5 * away.squaredNorm();
  const double above = rise + along + squared;
  if (above > kRounding * (std::abs(rise) + std::abs(along) + squared)) return false;
  step_ = newton_step + away;
  add(step_, std::max(0.0, -above));
  return true;
}

void NewtonBundle::move(const VecX& d, double fall) {
  int kept = 0;
  const double squared = 0.5 * d.squaredNorm();
  for (int i = 0; i < count_; ++i) {
    const double gap = gaps_[i] + steps_.col(i).dot(d) - squared - fall;
    if (gap < 0.0) continue;
    if (kept != i) steps_.col(kept) = steps_.col(i);
    steps_.col(kept) -= d;
    gaps_[kept] = gap;
    weights_[kept] = weights_[i];
    ++kept;
  }
  count_ = kept;
}

// Moves weight from the worst of the pieces in use to the best of all, until both are as good.
void NewtonBundle::solve() {
  const auto steps = steps_.leftCols(count_);
  auto products = products_.topLeftCorner(count_, count_);
  products.noalias() = steps.transpose() * steps;
  const auto gaps = gaps_.head(count_);
  auto weights = weights_.head(count_);
  auto slopes = slopes_.head(count_);
  weights.setZero();
  weights[count_ - 1] = 1.0;
  for (int k = 0; k < kMaxIterations; ++k) {
    slopes.noalias() = products * weights;
    fall_ = 0.5 * weights.dot(slopes) + weights.dot(gaps);
    slopes += gaps;
    Eigen::Index best = 0, worst = -1;
    slopes.minCoeff(&best);
    for (int i = 0; i < count_; ++i) {
      if (weights[i] > 0.0 && (worst < 0 || slopes[i] > slopes[worst])) worst = i;
    }
    const double gain = slopes[worst] - slopes[best];
    if (gain <= kTolerance * std::max(1e-300, fall_)) break;
    const double curvature =
        products(best, best) - 2.0 * products(best, worst) + products(worst, worst);
    const double moved =
        curvature > 0.0 ? std::min(weights[worst], gain / curvature) : weights[worst];
    weights[worst] = moved == weights[worst] ? 0.0 : weights[worst] - moved;
    weights[best] += moved;
  }
  step_.noalias() = steps * weights;
}

QuasiNewton::QuasiNewton(Eigen::Index size)
    : inverse_(Eigen::MatrixXd::Identity(size, size)), product_(size) {}

// M + (1 + y M y / s y) s s^T / s y - (M y s^T + s y^T M) / s y
bool QuasiNewton::learn(const VecX& step, const VecX& change_of_gradient) {
  const double curvature = step.dot(change_of_gradient);
  if (!(curvature > kMinCurvature * step.norm() * change_of_gradient.norm())) return false;
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
