// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/paired_test.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace brainshift::bench {
namespace {

// Two-sided p of published tables: t = 2.571 at 5 degrees of freedom is 0.05, 4.032 is 0.01; 12.706
// at 1 is 0.05; 1.984 at 100 is 0.05.
TEST(IncompleteBeta, GivesTheTabledQuantilesOfStudent) {
  const auto p = [](double t, double f) { return incomplete_beta(f / 2, 0.5, f / (f + t * t)); };
  EXPECT_NEAR(p(2.5706, 5), 0.05, 1e-5);
  EXPECT_NEAR(p(4.0321, 5), 0.01, 1e-5);
  EXPECT_NEAR(p(12.7062, 1), 0.05, 1e-5);
  EXPECT_NEAR(p(1.98397, 100), 0.05, 1e-5);
  EXPECT_EQ(incomplete_beta(2.0, 3.0, 0.0), 0.0);
  EXPECT_EQ(incomplete_beta(2.0, 3.0, 1.0), 1.0);
  EXPECT_NEAR(incomplete_beta(1.0, 1.0, 0.37), 0.37, 1e-14);  // uniform
}

// Student's own sleep data (1908): ten pairs, t = -4.0621, p = 0.00283.
TEST(PairedTest, OfStudentsSleepData) {
  const std::vector<double> first = {0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0};
  const std::vector<double> second = {1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4};
  const PairedTest test = paired_t_test(first, second);
  EXPECT_EQ(test.pairs, 10);
  EXPECT_NEAR(test.mean, -1.58, 1e-12);
  EXPECT_NEAR(test.t, -4.0621, 1e-4);
  EXPECT_NEAR(test.p, 0.002833, 1e-6);
}

TEST(PairedTest, LeavesMissingPairsOutAndNeedsTwo) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> a = {1.0, none, 3.0}, b = {2.0, 5.0, none};
  const PairedTest test = paired_t_test(a, b);
  EXPECT_EQ(test.pairs, 1);
  EXPECT_EQ(test.mean, -1.0);
  EXPECT_EQ(test.p, 1.0);
  EXPECT_EQ(paired_t_test({}, {}).pairs, 0);
  const std::vector<double> up = {2.0, 3.0}, down = {1.0, 2.0};
  EXPECT_EQ(paired_t_test(up, down).p, 0.0);
  EXPECT_EQ(paired_t_test(up, up).p, 1.0);
}

}  // namespace
}  // namespace brainshift::bench
