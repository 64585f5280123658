// SPDX-License-Identifier: Apache-2.0
#include "common/core/text.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <string>

namespace brainshift {
namespace {

TEST(OneLine, LeavesWhatIsReadAsItIsWritten) {
  for (const char* text :
       {"", "plain words, 3.5 mm", "\u00e4\u00f6\u00fc \u2264 \u65e5\u672c \U0001f9e0"}) {
    EXPECT_EQ(one_line(text), text);
  }
}

TEST(OneLine, LetsNothingThroughThatDrivesATerminalOrTurnsTheLine) {
  const char* const bad[] = {"\n",     "\r",     "\t",     "\x1b",   "\x7f",
                             "\u0085", "\u009b", "\u061c", "\u200b", "\u200f",
                             "\u2028", "\u202e", "\u2066", "\u2069", "\ufeff"};
  for (const std::string control : bad) {
    EXPECT_EQ(one_line("a" + control + "b", '?'), "a?b");
    EXPECT_EQ(one_line("a" + control + "b"), "a b");
  }
  EXPECT_EQ(one_line(std::string("\0", 1), '?'), "?");
  EXPECT_EQ(one_line("\x9b\xc2", '?'), "??") << "bytes of no UTF-8, among them a bare C1 control";
}

TEST(InQuotes, CutsALongTextBetweenCharacters) {
  std::string long_text;
  for (int i = 0; i < 65; ++i) long_text += "\u00e4";
  EXPECT_EQ(in_quotes(long_text), '"' + long_text.substr(0, 128) + "...\"");
  EXPECT_EQ(in_quotes("a\x1b[2J"), "\"a?[2J\"");
  EXPECT_EQ(in_quotes("plain"), "\"plain\"");
}

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
