// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include <cmath>

#include "common/core/random.hpp"
#include "common/inversion/condensed/newton_steps.hpp"

namespace brainshift::inversion {
namespace {

VecX vec(double x, double y) { return Eigen::Vector2d(x, y); }

TEST(NewtonBundle, OnePieceIsItsOwnMinimum) {
  NewtonBundle bundle(2);
  bundle.add_here(vec(3.0, -1.0));
  bundle.solve();
  EXPECT_EQ(bundle.step(), vec(3.0, -1.0));
  EXPECT_DOUBLE_EQ(bundle.fall(), 5.0);
}

TEST(NewtonBundle, WhereTwoPiecesMeetTheStepIsTheFootOfThePerpendicular) {
  NewtonBundle bundle(2);
  bundle.add_here(vec(1.0, 3.0));
  bundle.add_here(vec(1.0, -1.0));
  bundle.solve();
  EXPECT_NEAR((bundle.step() - vec(1.0, 0.0)).norm(), 0.0, 1e-5);
  EXPECT_NEAR(bundle.fall(), 0.5, 1e-6);
}

TEST(NewtonBundle, PiecesAroundTheOriginPromiseNothing) {
  NewtonBundle bundle(2);
  for (const VecX& s : {vec(1, 2), vec(-3, 1), vec(0.5, -2)}) bundle.add_here(s);
  bundle.solve();
  EXPECT_LT(bundle.fall(), 1e-6);
}

// max(q1, q2) with q1 = 1/2 |x - a|^2 and q2 = 1/2 |x - b|^2 + c: the step from any point of the
// first piece, once the second was met anywhere, is the minimum of the edge.
TEST(NewtonBundle, APieceThatWasMetElsewhereIsSeenFromThePoint) {
  const VecX a = vec(4.0, 0.0), b = vec(-4.0, 1.0);
  const double c = 3.0;
  const auto q1 = [&](const VecX& x) { return 0.5 * (x - a).squaredNorm(); };
  const auto q2 = [&](const VecX& x) { return 0.5 * (x - b).squaredNorm() + c; };
  const VecX point = vec(-5.0, 0.0), trial = vec(3.5, 2.0);
  ASSERT_GT(q1(point), q2(point));
  ASSERT_GT(q2(trial), q1(trial));
  NewtonBundle bundle(2);
  bundle.add_here(a - point);
  bundle.add_at(trial - point, q2(trial) - q1(point), b - trial);
  bundle.solve();
  const VecX found = point + bundle.step();
  EXPECT_NEAR(q1(found), q2(found), 1e-3);
  EXPECT_NEAR(bundle.fall(), q1(point) - q1(found), 1e-3);
  // On the edge, the direction along it does not fall: a - x and b - x are parallel there.
  const VecX to_a = a - found, to_b = b - found;
  EXPECT_NEAR(to_a[0] * to_b[1] - to_a[1] * to_b[0], 0.0, 1e-2);
  EXPECT_LT(to_a.dot(to_b), 0.0);
}

TEST(NewtonBundle, PiecesMoveWithThePoint) {
  const VecX a = vec(4.0, 0.0), b = vec(-4.0, 1.0), d = vec(0.5, 0.25);
  const VecX point = vec(-5.0, 0.0), trial = vec(3.5, 2.0);
  const auto q1 = [&](const VecX& x) { return 0.5 * (x - a).squaredNorm(); };
  const auto q2 = [&](const VecX& x) { return 0.5 * (x - b).squaredNorm() + 3.0; };
  NewtonBundle moved(2), there(2);
  moved.add_here(a - point);
  moved.add_at(trial - point, q2(trial) - q1(point), b - trial);
  moved.move(d, q1(point) - q1(point + d));
  ASSERT_EQ(moved.count(), 2);
  moved.solve();
  there.add_here(a - point - d);
  there.add_at(trial - point - d, q2(trial) - q1(point + d), b - trial);
  there.solve();
  EXPECT_NEAR((moved.step() - there.step()).norm(), 0.0, 1e-3);
  EXPECT_NEAR(moved.fall(), there.fall(), 1e-5 * there.fall());
}

TEST(NewtonBundle, APieceThatTheFunctionFallsBelowIsDropped) {
  NewtonBundle bundle(2);
  bundle.add_here(vec(1.0, 0.0));
  bundle.move(vec(0.5, 0.0), 1.0);  // the piece promised 3/8
  EXPECT_EQ(bundle.count(), 0);
}

// No step promises more: the minimum of the model is above that of each of its pieces' mixtures.
TEST(NewtonBundle, MeetsTheConditionOfTheMinimum) {
  Random random(3);
  NewtonBundle bundle(40);
  std::vector<VecX> steps;
  for (int i = 0; i < NewtonBundle::kMost; ++i) {
    VecX s = VecX::Constant(40, 0.4);
    for (double& value : s) value += random.normal();
    steps.push_back(s);
    bundle.add_here(s);
  }
  bundle.solve();
  const double squared = bundle.step().squaredNorm();
  ASSERT_GT(squared, 1.0);
  for (const VecX& s : steps) EXPECT_GT(s.dot(bundle.step()), squared * (1.0 - 1e-5));
}

TEST(NewtonBundle, AFullOneKeepsWhatCounts) {
  Random random(4);
  NewtonBundle bundle(5);
  double before = 1e9;
  for (int i = 0; i < 3 * NewtonBundle::kMost; ++i) {
    VecX s = VecX::Constant(5, 2.0);
    for (double& value : s) value += random.normal();
    bundle.add_here(s);
    bundle.solve();
    EXPECT_LE(bundle.fall(), before * (1.0 + 1e-5)) << i;
    EXPECT_LE(bundle.count(), NewtonBundle::kMost);
    before = bundle.fall();
  }
}

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
