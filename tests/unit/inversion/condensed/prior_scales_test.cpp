// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/prior_scales.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "common/core/random.hpp"

namespace brainshift::inversion {
namespace {

using Eigen::MatrixXd;

constexpr prior::LoadModeCounts kLoads{6, 8};
constexpr int kModes = 48, kCommon = 2, kData = 300;
constexpr ModeWindow kWindow{0, kModes};

struct Problem {
  MatrixXd jacobian;  // whitened [common | modes]
  VecX data;          // whitened
  MatrixXd gram() const { return jacobian.transpose() * jacobian; }
  VecX right() const { return jacobian.transpose() * data; }
};

int part(int mode) {
  if (mode >= 14) return 3;
  if (mode >= 6) return 2;
  return mode % 3 == 0 ? 0 : 1;
}

// Data drawn from the model whose parts have the given scales.
Problem drawn(const PriorScaleValues& scales, std::uint64_t seed) {
  Random random(seed);
  Problem problem{MatrixXd(kData, kCommon + kModes), VecX(kData)};
  for (Eigen::Index i = 0; i < problem.jacobian.size(); ++i) {
    problem.jacobian.data()[i] = 3.0 * random.normal();
  }
  VecX truth(kCommon + kModes);
  for (int i = 0; i < truth.size(); ++i) {
    const double scale = i < kCommon ? 1.0 : scales[static_cast<std::size_t>(part(i - kCommon))];
    truth[i] = scale * random.normal();
  }
  for (int i = 0; i < kData; ++i) problem.data[i] = random.normal();
  problem.data += problem.jacobian * truth;
  return problem;
}

// ln p(d | s) p(s) by the covariance of the data, up to a constant.
double log_posterior(const Problem& problem, const PriorScaleValues& scales) {
  VecX variance = VecX::Ones(kCommon + kModes);
  double log_prior = 0.0;
  for (int i = 0; i < kModes; ++i) {
    const double scale = scales[static_cast<std::size_t>(part(i))];
    variance[kCommon + i] = scale * scale;
  }
  for (const double scale : scales) {
    log_prior -= 0.5 * std::pow(2.0 * std::log(scale) / kLogVarianceSd, 2);
  }
  MatrixXd covariance = problem.jacobian * variance.asDiagonal() * problem.jacobian.transpose();
  covariance.diagonal().array() += 1.0;
  const Eigen::LLT<MatrixXd> factor(covariance);
  const MatrixXd lower = factor.matrixL();
  return log_prior - 0.5 * problem.data.dot(factor.solve(problem.data)) -
         lower.diagonal().array().log().sum();
}

PriorScales fitted(const Problem& problem) {
  PriorScales scales(kLoads, kWindow, kCommon);
  scales.fit(problem.gram(), problem.right());
  return scales;
}

TEST(PriorScales, MaximiseTheEvidence) {
  const Problem problem = drawn({0.5, 0.05, 0.3, 0.2}, 3);
  const auto best = fitted(problem).scales();
  const double at_best = log_posterior(problem, best);
  EXPECT_GT(at_best, log_posterior(problem, {1, 1, 1, 1}) + 5.0) << "the test shows nothing";
  for (std::size_t g = 0; g < best.size(); ++g) {
    for (const double factor : {0.7, 1.4}) {
      auto other = best;
      other[g] *= factor;
      if (other[g] > kLargestScales[g]) continue;
      EXPECT_LT(log_posterior(problem, other), at_best + 0.02) << g << " times " << factor;
    }
  }
}

TEST(PriorScales, FindTheStrengthThatTheDataWereDrawnWith) {
  // 34 amplitudes are known to 1 / sqrt(2 * 34) of their standard deviation.
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    EXPECT_NEAR(std::log(fitted(drawn({0.5, 0.5, 0.5, 0.1}, seed)).of_other() / 0.1), 0.0, 0.4)
        << seed;
  }
}

TEST(PriorScales, DoNotGrowBeyondTheirBounds) {
  const auto scales = fitted(drawn({30.0, 30.0, 30.0, 30.0}, 4)).scales();
  EXPECT_EQ(scales, kLargestScales);
}

TEST(PriorScales, StayWhereNothingIsToGain) {
  const Problem problem = drawn({0.5, 0.05, 0.3, 0.2}, 3);
  PriorScales scales(kLoads, kWindow, kCommon);
  ASSERT_TRUE(scales.fit(problem.gram(), problem.right()));
  const auto first = scales.scales();
  EXPECT_FALSE(scales.fit(problem.gram(), problem.right()));
  EXPECT_EQ(scales.scales(), first);
  scales.reset();
  EXPECT_EQ(scales.of_mode(0), 1.0);
}

TEST(PriorScales, StayWhenTheNormalEquationsAreNotPositiveDefinite) {
  const Problem problem = drawn({0.5, 0.05, 0.3, 0.2}, 3);
  PriorScales scales(kLoads, kWindow, kCommon);
  EXPECT_FALSE(scales.fit(-problem.gram(), problem.right()));
  EXPECT_EQ(scales.of_other(), 1.0);
}

TEST(PriorScales, WithoutLoadModesEveryModeIsOther) {
  PriorScales scales(kLoads, {kLoads.all(), kModes}, kCommon);
  const Problem problem = drawn({0.1, 0.1, 0.1, 0.1}, 5);
  ASSERT_TRUE(scales.fit(problem.gram(), problem.right()));
  EXPECT_EQ(scales.of_mode(0), scales.of_other());
  EXPECT_EQ(scales.of_mode(1), scales.of_other());
}

}  // namespace
}  // namespace brainshift::inversion
