// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/table.hpp"

#include <gmock/gmock.h>

#include "tests/support/results.hpp"

namespace brainshift::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::optional<Vec3> place(const Cells& heading, const Heading::Words& sides = {}) {
  const auto columns = Heading(heading).place(sides);
  return columns ? columns->of({"1", "2", "3", "4", "5", "6"}) : std::nullopt;
}

TEST(Heading, NamesAPlaceInAnyOrderCaseAndSpelling) {
  EXPECT_EQ(place({"x", "y", "z"}), Vec3(1, 2, 3));
  EXPECT_EQ(place({"name", "Z (mm)", "X (mm)", "Y (mm)"}), Vec3(3, 4, 2));
  EXPECT_EQ(place({"r", "a", "s", "r_g_b"}), Vec3(1, 2, 3));
  EXPECT_EQ(place({"x", "y", "z", "red", "a"}), Vec3(1, 2, 3));
  EXPECT_EQ(place({"X_Before", "y-before", "before.z"}, {"before"}), Vec3(1, 2, 3));
}

TEST(Heading, TurnsLpsToRas) {
  EXPECT_EQ(place({"L", "P", "S"}), Vec3(-1, -2, 3));
  EXPECT_EQ(place({"x_lps", "y_lps", "z_lps"}), Vec3(-1, -2, 3));
  EXPECT_EQ(place({"x_ras", "y_ras", "z_ras"}), Vec3(1, 2, 3));
}

TEST(Heading, NamesNoPlaceWhereItIsNotSureOfOne) {
  for (const Cells& heading : {Cells{"u", "v", "w"},
                               {"x", "y"},
                               {"x", "y", "y"},
                               {"x", "y", "z", "x"},
                               {"x", "y", "z", "r", "a", "s"},
                               {"x_lps", "y_ras", "z"},
                               {"x_m", "y_m", "z_m"},
                               {"x_voxel", "y_voxel", "z_voxel"},
                               {"x_before", "y_before", "z_before"}}) {
    EXPECT_FALSE(place(heading)) << testing::PrintToString(heading);
  }
  EXPECT_FALSE(place({"x", "y", "z"}, {"before"}));
}

TEST(Heading, PlacesAreFiniteNumbers) {
  const PlaceColumns three{{0, 1, 2}};
  EXPECT_FALSE(three.of({"1", "2"}));
  EXPECT_FALSE(three.of({"1", "2", "nan"}));
  EXPECT_EQ(three.of({"1", " +2", "-3e1"}), Vec3(1, 2, -30));
}

TEST(Heading, PointsThatNobodyPlacedAreKnown) {
  const Heading heading({"x", "defined_before", "Defined"});
  EXPECT_TRUE(value_or_fail(heading.placed({"1", "1", "TRUE"})));
  EXPECT_FALSE(value_or_fail(heading.placed({"1", "1", "0"})));
  EXPECT_FALSE(value_or_fail(heading.placed({"1", "false", "1"})));
  EXPECT_THAT(refusal_of(heading.placed({"1", "2", "1"})), HasSubstr("\"2\" as defined"));
  EXPECT_TRUE(value_or_fail(Heading({"x"}).placed({"0"})));
}

TEST(Heading, AColumnHasOneOfItsNamesAndNoOtherWord) {
  const Heading heading({"frame", "u_px", "v (px)", "label"});
  EXPECT_EQ(heading.column({"u", "x"}, {"px"}), 1U);
  EXPECT_EQ(heading.column({"v", "y"}, {"px"}), 2U);
  EXPECT_EQ(heading.column({"u"}), std::nullopt);
  EXPECT_EQ(heading.column({"frame", "label"}), std::nullopt) << "two columns";
}

TEST(Table, AFirstRowWithoutANumberIsItsHeading) {
  const Table table = parse_table("# hand made\nx,\"y, z\"\n\n1,2 # two\n", true);
  ASSERT_TRUE(table.heading);
  EXPECT_EQ(table.heading_row.line, 2);
  EXPECT_THAT(table.heading_row.cells, ElementsAre("x", "y, z"));
  ASSERT_EQ(table.rows.size(), 1U);
  EXPECT_EQ(table.rows[0].line, 4);
  EXPECT_THAT(table.rows[0].cells, ElementsAre("1", "2"));
  EXPECT_THAT(parse_table("a #1,2\n").rows[0].cells, ElementsAre("a #1", "2"));
}

TEST(Table, ACommentOfAsManyWordsAsTheRowsIsAHeadingToo) {
  EXPECT_TRUE(parse_table("# l,p,s\n1,2,3\n").heading);
  EXPECT_FALSE(parse_table("# l,p\n1,2,3\n").heading);
  EXPECT_FALSE(parse_table("# made by hand, on Monday, twice\n1,2,3\n").heading);
  EXPECT_FALSE(parse_table("1,2,3\n# l,p,s\n4,5,6\n").heading);
  EXPECT_FALSE(parse_table("# alone\n7\n").heading);
  EXPECT_EQ(parse_table("###\n#\n1,2,3\n").rows.size(), 1U);
}

}  // namespace
}  // namespace brainshift::io
