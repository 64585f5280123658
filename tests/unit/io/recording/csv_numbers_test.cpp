// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/csv_numbers.hpp"

#include <gmock/gmock.h>

namespace brainshift::io {
namespace {

using testing::ElementsAre;

TEST(CsvNumbers, CellsAreTrimmedAndOneIsAlwaysThere) {
  EXPECT_THAT(cells_of(" a ,b,, c\t"), ElementsAre("a", "b", "", "c"));
  EXPECT_THAT(cells_of(""), ElementsAre(""));
  EXPECT_EQ(trimmed("  x y \r"), "x y");
  EXPECT_EQ(trimmed(" \t"), "");
}

TEST(CsvNumbers, ANumberIsTheWholeTextAndFinite) {
  double number = 7.0;
  for (const char* text : {"", "x", "1x", "1 2", "nan", "inf", "-inf", "1e999", "1,5"}) {
    EXPECT_FALSE(parse_number(text, number)) << text;
  }
  EXPECT_TRUE(parse_number("-2.5e1", number));
  EXPECT_EQ(number, -25.0);
}

}  // namespace
}  // namespace brainshift::io
