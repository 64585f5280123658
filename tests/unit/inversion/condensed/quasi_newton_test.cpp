// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/quasi_newton.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "common/core/random.hpp"

namespace brainshift::inversion {
namespace {

constexpr Eigen::Index kSize = 6;

VecX random_vector(Random& random) {
  VecX v(kSize);
  for (double& value : v) value = random.normal();
  return v;
}

// A second derivative with eigenvalues from 1 on.
Eigen::MatrixXd second_derivative(Random& random) {
  Eigen::MatrixXd a(kSize, kSize);
  for (double& value : a.reshaped()) value = random.normal();
  return a * a.transpose() + Eigen::MatrixXd::Identity(kSize, kSize);
}

VecX apply(const QuasiNewton& estimate, const VecX& v) {
  VecX out(kSize);
  estimate.apply(v, out);
  return out;
}

TEST(QuasiNewton, BeginsWithTheIdentity) {
  Random random(1);
  QuasiNewton estimate(kSize);
  const VecX v = random_vector(random);
  EXPECT_EQ(apply(estimate, v), v);
  const VecX s = random_vector(random);
  ASSERT_TRUE(estimate.learn(s, 3.0 * s));
  EXPECT_NE(apply(estimate, v), v);
  estimate.reset();
  EXPECT_EQ(apply(estimate, v), v);
}

TEST(QuasiNewton, MeetsTheSecantEquationOfTheLastPair) {
  Random random(2);
  const Eigen::MatrixXd h = second_derivative(random);
  QuasiNewton estimate(kSize);
  for (int i = 0; i < 10; ++i) {
    const VecX s = random_vector(random);
    ASSERT_TRUE(estimate.learn(s, h * s));
    EXPECT_NEAR((apply(estimate, h * s) - s).norm(), 0.0, 1e-10 * s.norm());
  }
}

// With exact line searches on a quadratic function, BFGS ends in as many steps as there are
// unknowns (Nocedal & Wright 2006, theorem 6.4).
TEST(QuasiNewton, EndsOnAQuadraticFunctionInAsManyStepsAsUnknowns) {
  Random random(3);
  const Eigen::MatrixXd h = second_derivative(random);
  QuasiNewton estimate(kSize);
  VecX x = random_vector(random), gradient = h * x;
  for (Eigen::Index k = 0; k < kSize; ++k) {
    const VecX direction = -apply(estimate, gradient);
    const double length = -gradient.dot(direction) / direction.dot(h * direction);
    x += length * direction;
    const VecX next = h * x;
    estimate.learn(length * direction, next - gradient);
    gradient = next;
  }
  EXPECT_LT(x.norm(), 1e-8);
}

TEST(QuasiNewton, StaysPositiveDefiniteAndLeavesOutPairsWithoutCurvature) {
  Random random(4);
  QuasiNewton estimate(kSize);
  for (int i = 0; i < 200; ++i) {
    const VecX s = random_vector(random), y = random_vector(random), v = random_vector(random);
    const VecX before = apply(estimate, v);
    const bool learned = estimate.learn(s, y);
    EXPECT_EQ(learned, s.dot(y) > 0.0);
    if (!learned) {
      EXPECT_EQ(apply(estimate, v), before);
    }
    EXPECT_GT(v.dot(apply(estimate, v)), 0.0);
  }
}

}  // namespace
}  // namespace brainshift::inversion
