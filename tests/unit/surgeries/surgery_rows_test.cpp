// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/surgery_rows.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "tests/benchmarks/csv_table.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::surgeries {
namespace {

using testing::HasSubstr;

SurgeryFacts facts(std::uint64_t seed, const std::string& scenario) {
  SurgeryFacts facts;
  facts.key = {"head", 2, seed, scenario};
  return facts;
}

Row row(const SurgeryFacts& of) {
  Update update;
  update.estimate.reason = "settled, at last";
  update.estimate.quality.flags.set(QualityFlag::kStrengthAtBound);
  update.estimate.quality.flags.set(QualityFlag::kVolumeLost);
  update.estimate.quality.quality = update.estimate.quality.flags.quality();
  update.timings.register_ms = 1.0;
  update.timings.invert_ms = 2.0;
  update.timings.rebuild_ms = 4.0;
  UpdateScore score;
  score.recovered_pct = 97.5;
  return row_of(of, {}, {}, 0, update, score, std::numeric_limits<double>::quiet_NaN());
}

class RowTable : public testing::Test {
 protected:
  RowFile open(bool resume) {
    auto file = open_surgeries(path, resume);
    EXPECT_TRUE(file) << file.error().message;
    return *file;
  }
  test_support::TemporaryFolder folder;
  std::filesystem::path path = folder.path() / "rows.csv";
};

TEST_F(RowTable, ReadsBackWhatAnUpdateWas) {
  RowFile file = open(false);
  const SurgeryFacts one = facts(7, "paper");
  ASSERT_TRUE(file.append({row(one), refused_row(one, 1, "no data, no estimate")}));
  const auto table = bench::CsvTable::read(path);
  ASSERT_TRUE(table) << table.error().message;
  ASSERT_EQ(table->rows(), 2u);
  EXPECT_EQ(table->text(0, "scenario"), "paper");
  EXPECT_EQ(table->text(0, "stage"), "tumour");
  EXPECT_EQ(table->number(0, "place"), 2.0);
  EXPECT_EQ(table->number(0, "seed"), 7.0);
  EXPECT_EQ(table->text(0, "reason"), "settled; at last");
  EXPECT_EQ(table->text(0, "quality"), "unusable");
  EXPECT_EQ(table->text(0, "flags"), "strength_at_bound;volume_lost");
  EXPECT_EQ(table->number(0, "recovered_pct"), 97.5);
  EXPECT_EQ(table->number(0, "update_ms"), 7.0);
  EXPECT_EQ(table->text(0, "warm_cold_mm"), "");
  EXPECT_EQ(table->text(1, "status"), "refused");
  EXPECT_EQ(table->text(1, "reason"), "no data; no estimate");
  EXPECT_EQ(table->text(1, "quality"), "");
  EXPECT_EQ(table->text(1, "recovered_pct"), "");
  EXPECT_EQ(table->text(1, "stage"), "tumour+cortex");
}

TEST_F(RowTable, ARunThatGoesOnKnowsWhatIsThere) {
  const SurgeryFacts one = facts(7, "paper"), other = facts(8, "paper");
  {
    RowFile file = open(true);
    EXPECT_FALSE(file.has(one.key.texts()));
    ASSERT_TRUE(file.append({row(one)}));
    EXPECT_TRUE(file.has(one.key.texts()));
  }
  RowFile again = open(true);
  EXPECT_TRUE(again.has(one.key.texts()));
  EXPECT_FALSE(again.has(other.key.texts()));
  EXPECT_FALSE(again.has(facts(7, "joint-sag").key.texts()));
  ASSERT_TRUE(again.append({row(other)}));
  EXPECT_EQ(bench::CsvTable::read(path)->rows(), 2u);
  EXPECT_FALSE(open(false).has(one.key.texts()));
  EXPECT_EQ(bench::CsvTable::read(path)->rows(), 0u);
}

TEST_F(RowTable, TwoRunsDoNotWriteToOneTable) {
  RowFile first = open(true);
  ASSERT_TRUE(first.append({row(facts(7, "paper"))}));
  RowFile second = open(true);
  ASSERT_TRUE(second.append({row(facts(8, "paper"))}));
  const auto refused = first.append({row(facts(8, "paper"))});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kWriteFailed);
  EXPECT_THAT(refused.error().message, HasSubstr("another run writes to it"));
  ASSERT_TRUE(second.append({row(facts(9, "paper"))}));
  std::filesystem::remove(path);
  EXPECT_FALSE(second.append({row(facts(9, "paper"))}));
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(RowTable, ATableOfOtherColumnsIsNotContinued) {
  std::ofstream(path) << "head,place\nx,1\n";
  const auto file = open_surgeries(path, true);
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, ErrorCode::kUnreadable);
  EXPECT_THAT(file.error().message, HasSubstr("rows.csv"));
}

TEST_F(RowTable, ARowThatWasCutOffIsReported) {
  {
    RowFile file = open(false);
    const SurgeryFacts one = facts(7, "paper");
    ASSERT_TRUE(file.append({row(one)}));
  }
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 60);
  const auto file = open_surgeries(path, true);
  ASSERT_FALSE(file);
  EXPECT_THAT(file.error().message, HasSubstr("line 2"));
}

TEST_F(RowTable, AFolderThatIsNotThereIsReported) {
  const auto file = open_surgeries(folder.path() / "none" / "rows.csv", false);
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().code, ErrorCode::kWriteFailed);
}

}  // namespace
}  // namespace brainshift::surgeries
