// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/ablations/ablation_tables.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/support/temporary_folder.hpp"
#include "tests/unit/ablations/made_up_rows.hpp"

namespace brainshift::ablations {
namespace {

using testing::HasSubstr;

std::string text_of_file(const std::filesystem::path& path) {
  std::ifstream stream(path);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

const std::filesystem::path kDocs = BRAINSHIFT_DOCS;

// The page and the rows beside it say the same.
TEST(AblationsPage, HasTheTableOfItsRows) {
  const auto table = bench::CsvTable::read(kDocs / "ablations" / "rows.csv");
  ASSERT_TRUE(table) << table.error().message;
  ASSERT_GT(table->rows(), 5000u);
  const std::string page = text_of_file(kDocs / "ablations.md");
  EXPECT_THAT(page, HasSubstr(parts_table(surgeries::Rows(*table))));
  EXPECT_THAT(page, HasSubstr(left_out_list()));
}

TEST(ShortRows, GiveTheSameTable) {
  MadeUpRows rows;
  for (const int seed : {1, 2}) {
    rows.add("default", "mesh", "tumour", seed, 1.0);
    rows.add("fixed", "mesh", "tumour", seed, 2.0);
  }
  const auto table = rows.table();
  const auto read = bench::CsvTable::parse(short_rows(surgeries::Rows(table)), "short");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->rows(), 4u);
  EXPECT_EQ(parts_table(surgeries::Rows(*read)), parts_table(surgeries::Rows(table)));
}

// Contact halves the error; the rank does nothing; a higher rank is better by a third.
bench::CsvTable made_up() {
  MadeUpRows rows;
  for (int seed = 1; seed <= 8; ++seed) {
    const double noise = 1e-4 * seed;
    rows.add("default", "mesh", "tumour", seed, 1.0);
    rows.add("fixed", "mesh", "tumour", seed, 2.0 + noise);
    rows.add("low-rank", "mesh", "tumour", seed, 1.0 + noise);
    rows.add("high-rank", "mesh", "tumour", seed, 0.67 - noise);
  }
  return rows.table();
}

TEST(PartsTable, SaysWhatAPartBuysAndThatAnotherBuysNothing) {
  const auto table = made_up();
  const std::string text = parts_table(surgeries::Rows(table));
  EXPECT_THAT(text,
              HasSubstr("| contact | boundary condition fixed | 2.00 | 2.00 | 2.00 | 2.00 | – | "
                        "12 of 16; tumour, all surgeries, tumour alone: 1.00 → 2.00 mm | "
                        "nothing |"));
  EXPECT_THAT(text, HasSubstr("1.00 | 1.00 | 1.00 | 1.00 | – | nothing | nothing |"));
  EXPECT_THAT(text, HasSubstr("| a higher rank (off by default) |"));
}

TEST(AblationChecks, TurnRedForAPartOfTheDefaultThatBuysNothing) {
  const test_support::TemporaryFolder folder;
  setenv("BRAINSHIFT_STUDY_DIR", folder.path().c_str(), 1);
  const auto table = made_up();
  check_ablations(surgeries::Rows(table));
  unsetenv("BRAINSHIFT_STUDY_DIR");
  const std::string checks = text_of_file(folder.path() / "checks.csv");
  EXPECT_THAT(checks, HasSubstr("ablations,contact: combinations in which it buys something,12,"
                                ">= 1 (of 16; it costs something in 0),1,"));
  EXPECT_THAT(checks, HasSubstr("ablations,rank: combinations in which it buys something,0,"
                                ">= 1 (of 16; it costs something in 0),0,"));
  EXPECT_THAT(checks, HasSubstr("ablations,a higher rank: combinations in which it buys "
                                "something,12,shown; of 16; it costs something in 0,,"));
  EXPECT_THAT(text_of_file(folder.path() / "left_out.csv"), HasSubstr("ablations,calculix: "));
}

TEST(AblationPictures, AreDrawn) {
  const test_support::TemporaryFolder folder;
  const auto table = made_up();
  ASSERT_TRUE(draw_ablations(surgeries::Rows(table), folder.path()));
  EXPECT_GT(std::filesystem::file_size(folder.path() / "ablations-tumour-prior.png"), 1000u);
  EXPECT_FALSE(draw_ablations(surgeries::Rows(table), folder.path() / "no-such"));
}

}  // namespace
}  // namespace brainshift::ablations
