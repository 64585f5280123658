// SPDX-License-Identifier: Apache-2.0
#include "common/core/utc_time.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace brainshift {
namespace {

// Seconds since the epoch of a text in the default format, by the days of the civil calendar.
long seconds_of(const std::string& text) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0, end = 0;
  const int read = std::sscanf(text.c_str(), "%4d-%2d-%2dT%2d:%2d:%2dZ%n", &year, &month, &day,
                               &hour, &minute, &second, &end);
  if (read != 6 || static_cast<std::size_t>(end) != text.size()) return -1;
  long days = day - 1;
  const auto leap = [](int y) { return (y % 4 == 0 && y % 100 != 0) || y % 400 == 0; };
  const int lengths[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  for (int y = 1970; y < year; ++y) days += leap(y) ? 366 : 365;
  for (int m = 1; m < month; ++m) days += lengths[m - 1] + (m == 2 && leap(year) ? 1 : 0);
  return ((days * 24 + hour) * 60 + minute) * 60 + second;
}

TEST(UtcTime, IsTheTimeOfDayInIso8601WhateverTheZone) {
  setenv("TZ", "Asia/Kolkata", 1);
  tzset();
  const auto before = static_cast<long>(std::time(nullptr));
  const std::string text = utc_now();
  const auto after = static_cast<long>(std::time(nullptr));
  EXPECT_GE(seconds_of(text), before) << text;
  EXPECT_LE(seconds_of(text), after) << text;
}

TEST(UtcTime, FollowsTheFormat) {
  EXPECT_EQ(utc_now("%Y%m%dT%H%M%SZ").size(), std::string("20250131T123456Z").size());
  EXPECT_EQ(utc_now("a"), "a");
}

}  // namespace
}  // namespace brainshift
