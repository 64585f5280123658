// SPDX-License-Identifier: GPL-3.0-or-later
// Scores against their definitions, by quadrature.

#include "tests/surgeries/interval_scores.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace brainshift::surgeries {
namespace {

double cumulative(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }
double density(double x) { return std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi); }

// Midpoint rule on fine cells.
double integral(double low, double high, const std::function<double(double)>& f) {
  constexpr int kCells = 200000;
  const double cell = (high - low) / kCells;
  double sum = 0.0;
  for (int i = 0; i < kCells; ++i) sum += f(low + (i + 0.5) * cell);
  return cell * sum;
}

TEST(IntervalScore, IsTheWidthWithinAndTwentyTimesTheExcessBeyond) {
  const double half = 1.6448536269514722 * 0.5;
  EXPECT_DOUBLE_EQ(interval_score(0.0, 0.5), 2.0 * half);
  EXPECT_DOUBLE_EQ(interval_score(half, 0.5), 2.0 * half);
  EXPECT_NEAR(interval_score(half + 0.1, 0.5), 2.0 * half + 2.0, 1e-12);
  EXPECT_DOUBLE_EQ(interval_score(-1.3, 0.5), interval_score(1.3, 0.5));
  EXPECT_DOUBLE_EQ(interval_score(0.3, 0.0), 6.0);
}

// The integral over all thresholds of the squared distance between the distribution and the step
// at what came true (Gneiting and Raftery 2007, eq. 20).
TEST(GaussianCrps, IsTheIntegralThatDefinesIt) {
  for (const double error : {0.0, 0.7, -2.5}) {
    const double sd = 0.8;
    const double defined = integral(-12.0, 12.0, [&](double x) {
      const double off = cumulative(x / sd) - (x >= error ? 1.0 : 0.0);
      return off * off;
    });
    EXPECT_NEAR(gaussian_crps(error, sd), defined, 1e-4) << error;
  }
  EXPECT_DOUBLE_EQ(gaussian_crps(-0.4, 0.0), 0.4);
}

// On average least where the standard deviation is that of the errors.
TEST(Scores, AreProper) {
  for (const auto score : {interval_score, gaussian_crps}) {
    const auto expected = [&](double sd) {
      return integral(-9.0, 9.0, [&](double x) { return density(x) * score(x, sd); });
    };
    const double right = expected(1.0);
    for (const double sd : {0.5, 0.9, 1.1, 2.0}) EXPECT_GT(expected(sd), right + 1e-3) << sd;
  }
}

TEST(SimultaneousRadius, LeavesATenthOverAllOfThem) {
  EXPECT_NEAR(simultaneous_radius(1), 2.50028, 1e-4);
  for (const long count : {20L, 18000L}) {
    const double beyond = integral(simultaneous_radius(count), 30.0, [](double r) {
      return std::sqrt(2.0 / std::numbers::pi) * r * r * std::exp(-0.5 * r * r);
    });
    EXPECT_NEAR(beyond * static_cast<double>(count), 0.1, 1e-3) << count;
  }
}

TEST(Regions, CountWhatIsNear) {
  Points nodes(3, 4);
  nodes << 0, 10, 20, 40, 0, 0, 0, 0, 0, 0, 0, 0;
  Points place(3, 1);
  place << 5, 0, 0;
  EXPECT_EQ(nodes_near(nodes, {0, 1, 2, 3}, place, 15.0), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(nodes_near(nodes, {1, 3}, place, 15.0), (std::vector<int>{1}));
  EXPECT_TRUE(nodes_near(nodes, {0, 1}, Points(3, 0), 15.0).empty());
}

TEST(Regions, ScoreTheirOwnNodesOnly) {
  const Points truth = Points::Constant(3, 3, 1.0);
  Points estimate = truth;
  estimate(0, 0) += 0.3;
  estimate.col(2).array() += 50.0;
  const VecX sd = VecX::Constant(3, 0.1);
  const RegionScore score = score_region(estimate, truth, sd, {0, 1});
  EXPECT_EQ(score.nodes, 2);
  EXPECT_NEAR(score.error_mm, 0.15, 1e-12);
  EXPECT_NEAR(score.none_mm, std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(score.coverage_90, 5.0 / 6.0, 1e-12);
  for (std::size_t i = 0; i < kIntervals.size(); ++i) {  // the error is three standard deviations
    EXPECT_NEAR(score.coverage[i], 5.0 / 6.0, 1e-12) << kIntervals[i].percent;
  }
  EXPECT_NEAR(score.rms_error_mm, 0.3 / std::sqrt(6.0), 1e-12);
  EXPECT_NEAR(score.rms_sd_mm, 0.1, 1e-12);
  EXPECT_NEAR(score.interval_mm, (interval_score(0.3, 0.1) + 5.0 * interval_score(0.0, 0.1)) / 6.0,
              1e-12);
  EXPECT_NEAR(score.crps_mm, (gaussian_crps(0.3, 0.1) + 5.0 * gaussian_crps(0.0, 0.1)) / 6.0,
              1e-12);
  EXPECT_TRUE(std::isnan(score_region(estimate, truth, sd, {}).error_mm));
  const RegionScore bare = score_region(estimate, truth, VecX(), {0, 1});
  EXPECT_TRUE(std::isnan(bare.interval_mm));
  EXPECT_TRUE(std::isnan(bare.coverage_90));
  EXPECT_NEAR(bare.error_mm, 0.15, 1e-12);
}

}  // namespace
}  // namespace brainshift::surgeries
