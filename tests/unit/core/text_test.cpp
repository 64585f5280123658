// SPDX-License-Identifier: Apache-2.0
#include "common/core/text.hpp"

#include <gtest/gtest.h>

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
}

}  // namespace
}  // namespace brainshift
