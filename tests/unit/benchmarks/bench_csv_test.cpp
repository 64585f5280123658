// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/csv_table.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::bench {
namespace {

using ::testing::HasSubstr;

TEST(CsvTable, ReadsCellsByColumn) {
  const auto table = value_or_fail(CsvTable::parse("a,b,c\r\n1.5,x,\n-2e-3,,7\n", "t.csv"));
  ASSERT_EQ(table.rows(), 2u);
  EXPECT_DOUBLE_EQ(table.number(0, "a"), 1.5);
  EXPECT_EQ(table.text(0, "b"), "x");
  EXPECT_TRUE(std::isnan(table.number(0, "b"))) << "a word is no number";
  EXPECT_TRUE(std::isnan(table.number(0, "c"))) << "an empty cell is no number";
  EXPECT_DOUBLE_EQ(table.number(1, "a"), -2e-3);
  EXPECT_DOUBLE_EQ(table.number(1, "c"), 7.0);
  EXPECT_FALSE(table.has("d"));
  EXPECT_EQ(table.text(1, "d"), "");
}

TEST(CsvTable, NamesTheLineWhoseCellsDoNotFit) {
  EXPECT_THAT(refusal_of(CsvTable::parse("a,b\n1,2\n3\n", "t.csv"), ErrorCode::kUnreadable),
              HasSubstr("t.csv: line 3 has 1 cells"));
  EXPECT_FALSE(CsvTable::parse("", "t.csv"));
  EXPECT_EQ(CsvTable::read("/nowhere/t.csv").error().code, ErrorCode::kNotFound);
}

TEST(CsvWriter, WritesWhatTheTableReads) {
  const test_support::TemporaryFolder folder;
  const auto path = folder.path() / "w.csv";
  auto writer = value_or_fail(CsvWriter::create(path, "name,value"));
  ASSERT_TRUE(writer.row({"pi", csv_number(3.14159265358979, 15)}));
  ASSERT_TRUE(writer.row({"none", csv_number(std::numeric_limits<double>::quiet_NaN())}));
  const auto table = CsvTable::read(path);  // rows are on disk although the writer is open
  ASSERT_TRUE(table);
  EXPECT_DOUBLE_EQ(table->number(0, "value"), 3.14159265358979);
  EXPECT_EQ(table->text(1, "value"), "");
  EXPECT_EQ(CsvWriter::create(folder.path() / "no" / "w.csv", "a").error().code,
            ErrorCode::kWriteFailed);
}

}  // namespace
}  // namespace brainshift::bench
