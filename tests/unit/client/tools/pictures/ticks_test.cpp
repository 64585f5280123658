// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/ticks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

namespace brainshift::client {
namespace {

TEST(Ticks, AreRoundAndWithinTheRange) {
  EXPECT_EQ(nice_ticks(0.0, 1.0, 5), (std::vector<double>{0.0, 0.2, 0.4, 0.2 * 3, 0.8, 1.0}));
  for (const auto& [min, max] : {std::pair{0.0, 3.7}, {-4.0, 131.0}, {0.012, 0.019}, {1e5, 3e5}}) {
    const auto ticks = nice_ticks(min, max);
    ASSERT_GE(ticks.size(), 2u);
    EXPECT_LE(ticks.size(), 12u);
    EXPECT_GE(ticks.front(), min - 1e-9 * max);
    EXPECT_LE(ticks.back(), max * (1 + 1e-9));
    const double step = ticks[1] - ticks[0];
    const double mantissa = step / std::pow(10.0, std::floor(std::log10(step) + 1e-9));
    EXPECT_TRUE(std::abs(mantissa - 1) < 1e-6 || std::abs(mantissa - 2) < 1e-6 ||
                std::abs(mantissa - 5) < 1e-6)
        << step;
  }
}

TEST(Ticks, LabelsShowAsManyDecimalsAsTheStepNeeds) {
  EXPECT_EQ(tick_label(0.30000000000000004, 0.1), "0.3");
  EXPECT_EQ(tick_label(25.0, 5.0), "25");
  EXPECT_EQ(tick_label(0.015, 0.005), "0.015");
  EXPECT_EQ(tick_label(-1e-17, 0.5), "0.0");
}

TEST(LogTicks, EqualRatiosAreEqualLengths) {
  EXPECT_DOUBLE_EQ(axis_fraction(1.0, 1.0, 1e4, true), 0.0);
  EXPECT_NEAR(axis_fraction(10.0, 1.0, 1e4, true), 0.25, 1e-15);
  EXPECT_NEAR(axis_fraction(1e4, 1.0, 1e4, true), 1.0, 1e-15);
  EXPECT_DOUBLE_EQ(axis_fraction(2.5, 0.0, 10.0, false), 0.25);
}

TEST(LogTicks, AreRoundAndWithinTheRange) {
  EXPECT_EQ(log_ticks(0.5, 20000.0), (std::vector<double>{1, 10, 100, 1000, 10000}));
  EXPECT_EQ(log_ticks(0.001, 0.1),
            (std::vector<double>{0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1}));
  for (const auto& [min, max] : {std::pair{1.07, 1.12}, {0.9, 3.1}, {1e-7, 1e5}, {17000, 19000}}) {
    const auto ticks = log_ticks(min, max);
    ASSERT_GE(ticks.size(), 3u) << min;
    EXPECT_GE(ticks.front(), min * (1 - 1e-9));
    EXPECT_LE(ticks.back(), max * (1 + 1e-9));
  }
}

TEST(LogTicks, LabelsAreShort) {
  EXPECT_EQ(log_tick_label(0.002), "0.002");
  EXPECT_EQ(log_tick_label(50.0), "50");
  EXPECT_EQ(log_tick_label(20000.0), "20000");
  EXPECT_EQ(log_tick_label(1e-5), "1e-05");
  EXPECT_EQ(log_tick_label(1e6), "1e+06");
}

}  // namespace
}  // namespace brainshift::client
