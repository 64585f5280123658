// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/journal/journal_copy.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "client/tools/journal/journal_check.hpp"
#include "tests/unit/client/tools/journal/small_journal.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class CopyJournal : public SmallJournal {
 protected:
  // A good, closed file with so many records.
  void expect_good(const fs::path& file, std::uint64_t records) const {
    const auto check = check_journal(file);
    ASSERT_TRUE(check) << check.error().message;
    EXPECT_FALSE(check->broken);
    EXPECT_TRUE(check->state.closed);
    EXPECT_EQ(check->records, records);
    EXPECT_EQ(check->meta.case_id, "box");
  }
  const fs::path out = folder / "out.surgery";
};

TEST_F(CopyJournal, ARepairedFileIsTheValidPrefixAndTheOriginalIsUntouched) {
  write(path, 9);
  run_sql(path, "UPDATE record SET payload = x'01' WHERE id = 12");
  const std::string before = test_support::content_of(path);
  const auto repaired = repair_journal(path, out);
  ASSERT_TRUE(repaired) << repaired.error().message;
  EXPECT_EQ(repaired->kept, 11u);
  EXPECT_EQ(repaired->of, 18u);
  ASSERT_TRUE(repaired->broken);
  EXPECT_THAT(repaired->broken->message, HasSubstr("record 12"));
  EXPECT_EQ(test_support::content_of(path), before);
  expect_good(out, 11);
  EXPECT_THAT(io::SurgeryFile::open(out)->meta().gap, HasSubstr("the valid prefix of a.surgery"));
  EXPECT_EQ(folder.entries(), 2u);
}

TEST_F(CopyJournal, ACutFileIsRepaired) {
  write(path, 30);
  fs::resize_file(path, fs::file_size(path) * 4 / 5);
  const auto repaired = repair_journal(path, out);
  ASSERT_TRUE(repaired) << repaired.error().message;
  EXPECT_TRUE(repaired->broken);
  EXPECT_GT(repaired->kept, 5u);
  expect_good(out, repaired->kept);
}

TEST_F(CopyJournal, ACrashedFileBecomesAClosedOne) {
  auto live = io::SurgeryFile::create(path, {.case_id = "box"});
  ASSERT_TRUE(live);
  ASSERT_TRUE(live->append(observation(1, "ius")));
  const auto repaired = repair_journal(path, out);
  ASSERT_TRUE(repaired) << repaired.error().message;
  EXPECT_FALSE(repaired->broken);
  expect_good(out, 1);
}

TEST_F(CopyJournal, ATrimmedFileHoldsTheRangeWithItsUpdatesAndTruth) {
  {
    auto file = io::SurgeryFile::create(path, {.case_id = "box"});
    ASSERT_TRUE(file);
    io::SurgeryTruth truth;
    for (std::uint64_t i = 1; i <= 9; ++i) {
      ASSERT_TRUE(file->append(observation(i, "ius")));
      ASSERT_TRUE(file->append(decision(i, Outcome::kUsed)));
      ASSERT_TRUE(file->append(update(100 + i, i)));
      truth.displacement = Points::Constant(3, 4, static_cast<double>(i));
      ASSERT_TRUE(file->write_truth(i, truth));
    }
    ASSERT_TRUE(file->close());
  }
  const auto trimmed = trim_journal(path, 4, 6, out);
  ASSERT_TRUE(trimmed) << trimmed.error().message;
  EXPECT_EQ(trimmed->kept, 9u);
  expect_good(out, 9);
  const auto file = io::SurgeryFile::open(out);
  EXPECT_EQ(file->records(io::RecordKind::kObservation)->front().sequence, 4u);
  EXPECT_EQ(file->records(io::RecordKind::kUpdate)->back().sequence, 106u);
  EXPECT_EQ(file->read_truth(5)->displacement(0, 0), 5.0);
  EXPECT_FALSE(file->read_truth(7));
  EXPECT_THAT(file->meta().gap, HasSubstr("observations 4 to 6 of a.surgery"));
}

TEST_F(CopyJournal, WhatCannotBeDoneLeavesNothingBehind) {
  write(path, 3);
  const auto expect = [&](const Result<CopiedJournal>& result, ErrorCode code,
                          const std::string& text) {
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, code) << result.error().message;
    EXPECT_THAT(result.error().message, HasSubstr(text));
    EXPECT_EQ(folder.entries(), 1u);
  };
  expect(trim_journal(path, 5, 4, out), ErrorCode::kInvalidArgument, "first = 5");
  expect(trim_journal(path, 50, 60, out), ErrorCode::kEmptySet, "no observation from 50 to 60");
  expect(repair_journal(folder / "none.surgery", out), ErrorCode::kNotFound, "none.surgery");
  expect(repair_journal(path, folder / "nowhere" / "b.surgery"), ErrorCode::kWriteFailed,
         "nowhere");
  run_sql(path, "UPDATE record SET payload = x'01' WHERE id = 5");
  expect(trim_journal(path, 1, 1, out), ErrorCode::kUnreadable, "record 5");
  run_sql(path, "UPDATE record SET payload = x'01' WHERE id = 1");
  expect(repair_journal(path, out), ErrorCode::kEmptySet, "no record is valid");
}

TEST_F(CopyJournal, NothingThatExistsIsReplaced) {
  write(path, 3);
  const std::string before = test_support::content_of(path);
  for (const auto& result : {repair_journal(path, path), trim_journal(path, 1, 2, path)}) {
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kWriteFailed);
    EXPECT_EQ(result.error().message, path.string() + ": exists already");
  }
  EXPECT_EQ(test_support::content_of(path), before);
  fs::create_symlink("nowhere", out);
  EXPECT_FALSE(repair_journal(path, out));
}

}  // namespace
}  // namespace brainshift::client
