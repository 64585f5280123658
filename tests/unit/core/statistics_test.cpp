// SPDX-License-Identifier: Apache-2.0
#include "common/core/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace brainshift {
namespace {

TEST(MeanStd, AgreesWithAHandComputedSample) {
  // Mean 5; squared deviations 9 + 1 + 1 + 1 + 0 + 0 + 4 + 16 = 32; 32 / 7.
  const std::vector<double> values = {2, 4, 4, 4, 5, 5, 7, 9};
  const MeanStd result = mean_std(values);
  EXPECT_DOUBLE_EQ(result.mean, 5.0);
  EXPECT_DOUBLE_EQ(result.std, std::sqrt(32.0 / 7.0));
}

TEST(MeanStd, IsZeroForNothingAndSpreadIsZeroForOne) {
  EXPECT_EQ(mean_std({}).mean, 0.0);
  EXPECT_EQ(mean_std({}).std, 0.0);
  const std::vector<double> one = {3.5};
  EXPECT_EQ(mean_std(one).mean, 3.5);
  EXPECT_EQ(mean_std(one).std, 0.0);
}

// The textbook formula (sum of squares minus squared mean) would lose every digit here.
TEST(MeanStd, KeepsASmallSpreadOnALargeOffset) {
  const std::vector<double> values = {1e9 + 1, 1e9 + 2, 1e9 + 3};
  EXPECT_DOUBLE_EQ(mean_std(values).std, 1.0);
}

TEST(MeanStd, ScalesWithTheUnit) {
  const std::vector<double> mm = {0.1, 0.5, 0.7, 2.0};
  std::vector<double> um;
  for (const double x : mm) um.push_back(1000.0 * x);
  EXPECT_NEAR(mean_std(um).mean, 1000.0 * mean_std(mm).mean, 1e-10);
  EXPECT_NEAR(mean_std(um).std, 1000.0 * mean_std(mm).std, 1e-10);
}

TEST(MeanStdOfNorms, TakesLengthsOfColumns) {
  Points vectors(3, 2);
  vectors << 3, 0, 4, 0, 0, 7;  // columns (3, 4, 0) and (0, 0, 7)
  const MeanStd result = mean_std_of_norms(vectors);
  EXPECT_DOUBLE_EQ(result.mean, 6.0);
  EXPECT_DOUBLE_EQ(result.std, std::sqrt(2.0));
}

TEST(MeanStdOfNorms, IsZeroForNoColumn) { EXPECT_EQ(mean_std_of_norms(Points(3, 0)).mean, 0.0); }

TEST(Percentile, InterpolatesBetweenOrderStatistics) {
  const std::vector<double> values = {40, 10, 30, 20};  // not sorted
  EXPECT_DOUBLE_EQ(percentile(values, 0), 10);
  EXPECT_DOUBLE_EQ(percentile(values, 100), 40);
  EXPECT_DOUBLE_EQ(percentile(values, 50), 25);
  EXPECT_DOUBLE_EQ(percentile(values, 100.0 / 3.0), 20);
  EXPECT_DOUBLE_EQ(percentile(values, 90), 37);
}

TEST(Percentile, OfOneValueIsThatValueAndOfNothingNotANumber) {
  const std::vector<double> one = {7};
  for (const double q : {0.0, 37.0, 100.0}) EXPECT_EQ(percentile(one, q), 7);
  EXPECT_TRUE(std::isnan(percentile({}, 50)));
}

TEST(Percentile, NeverFallsAsTheRankGrows) {
  const std::vector<double> values = {5, 1, 1, 9, -3, 5, 2};
  double last = percentile(values, 0);
  for (int q = 1; q <= 100; ++q) {
    const double next = percentile(values, q);
    EXPECT_GE(next, last);
    last = next;
  }
}

}  // namespace
}  // namespace brainshift
