// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/csv_numbers.hpp"

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

TEST(CsvNumbers, LettersGetLowerAndAllElseStays) {
  EXPECT_EQ(lower_case("Ab-Z9\xC3\x84"), "ab-z9\xC3\x84");
}

TEST(CsvNumbers, QuotedCellsKeepCommas) {
  EXPECT_THAT(quoted_cells_of(R"(a, "b, c" ,"say ""x""",)"),
              ElementsAre("a", "b, c", "say \"x\"", ""));
  EXPECT_THAT(quoted_cells_of(R"("open, end)"), ElementsAre("open, end"));
  EXPECT_THAT(quoted_cells_of(""), ElementsAre(""));
}

TEST(CsvNumbers, AHeadingHasNoNumber) {
  EXPECT_FALSE(has_number({"x", "y", ""}));
  EXPECT_TRUE(has_number({"name", "1.5"}));
}

TEST(CsvNumbers, ANumberIsTheWholeTextAndFinite) {
  double number = 7.0;
  for (const char* text : {"", "x", "1x", "1 2", "nan", "inf", "-inf", "1e999", "1,5"}) {
    EXPECT_FALSE(parse_number(text, number)) << text;
  }
  EXPECT_TRUE(parse_number("-2.5e1", number));
  EXPECT_EQ(number, -25.0);
  EXPECT_TRUE(parse_number("+7", number));
  EXPECT_FALSE(parse_number("+-7", number));
}

}  // namespace
}  // namespace brainshift::io
