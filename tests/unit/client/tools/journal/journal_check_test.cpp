// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <fstream>

#include "client/tools/journal/journal_check.hpp"
#include "client/tools/journal/journal_copy.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/client/tools/journal/small_journal.hpp"

namespace brainshift::client {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

class CheckJournal : public SmallJournal {};

TEST_F(CheckJournal, CountsWhatAGoodFileHolds) {
  write(path, 9);
  const auto check = value_or_fail(check_journal(path));
  EXPECT_FALSE(check.broken);
  EXPECT_EQ(check.records, 18u);
  EXPECT_EQ(check.observations.at("ius").count, 6u);
  EXPECT_EQ(check.observations.at("camera").first, 3u);
  EXPECT_EQ(check.observations.at("camera").last, 9u);
  EXPECT_EQ(check.updates.count, 9u);
  const auto lines = report_lines(check);
  EXPECT_EQ(lines[0], path.string() + ": 18 records, closed");
  EXPECT_THAT(lines, Contains("  observations 6 (1 to 8, 2 numbers left out) of ius"));
  EXPECT_THAT(lines, Contains("  updates      9 (1 to 9)"));
  EXPECT_THAT(lines, Contains("  checksums    all match"));
}

TEST_F(CheckJournal, DecisionsAreCountedByOutcome) {
  write_records({decision(1, Outcome::kUsed),
                 decision(2, Outcome::kUsed),
                 decision(3, Outcome::kUsed),
                 decision(4, Outcome::kSkipped),
                 decision(5, Outcome::kSkipped),
                 {io::RecordKind::kDecision, 6, 0, "\xff\xff"}});
  const auto check = value_or_fail(check_journal(path));
  EXPECT_THAT(report_lines(check), Contains("  decisions    2 skipped, 3 used"));
  ASSERT_TRUE(check.broken);
  EXPECT_THAT(check.broken->message, HasSubstr("record 6: decision 6: "));
}

TEST_F(CheckJournal, NamesTheFirstBadRecordAndCountsWhatIsInFrontOfIt) {
  write(path, 9);
  run_sql(path, "UPDATE record SET recorded_ns = 0 WHERE id = 7");
  const auto check = value_or_fail(check_journal(path));
  ASSERT_TRUE(check.broken);
  EXPECT_THAT(check.broken->message, HasSubstr(path.string() + ": record 7: "));
  EXPECT_EQ(check.records, 6u);
  EXPECT_THAT(report_lines(check), Contains("  valid        the first 6 of 18 records"));
  EXPECT_THAT(report_lines(check), Not(Contains(HasSubstr("all match"))));
}

TEST_F(CheckJournal, APayloadThatNobodyCanDecodeIsBad) {
  write_records({observation(1, "ius"), {io::RecordKind::kUpdate, 5, 0, "\xff\xff"}});
  const auto check = check_journal(path);
  ASSERT_TRUE(check && check->broken);
  EXPECT_THAT(check->broken->message, HasSubstr("record 2: update 5: "));
  EXPECT_EQ(check->records, 1u);
}

TEST_F(CheckJournal, AFileThatWasNotClosedIsGoodAndSaysSo) {
  auto file =
      value_or_fail(io::SurgeryFile::create(path, {.continues = "b.surgery", .gap = "disk full"}));
  ASSERT_TRUE(file.append(observation(1, "ius")));
  const auto check = value_or_fail(check_journal(path));
  EXPECT_FALSE(check.broken);
  const auto lines = report_lines(check);
  EXPECT_THAT(lines[0], HasSubstr("1 record, not closed"));
  EXPECT_THAT(lines, Contains("  goes on from b.surgery"));
  EXPECT_THAT(lines, Contains("  gap          disk full"));
}

TEST_F(CheckJournal, ACutFileIsBrokenAndWhatIsLeftIsCounted) {
  write(path, 30);
  // The tables themselves take the first half.
  std::filesystem::resize_file(path, std::filesystem::file_size(path) * 4 / 5);
  const auto check = value_or_fail(check_journal(path));
  ASSERT_TRUE(check.broken);
  EXPECT_GT(check.records, 5u);
  EXPECT_LT(check.records, 60u);
}

TEST_F(CheckJournal, WhatIsNoSurgeryFileIsAnError) {
  EXPECT_EQ(check_journal(path).error().code, ErrorCode::kNotFound);
  std::ofstream(path) << "text";
  EXPECT_EQ(check_journal(path).error().code, ErrorCode::kUnreadable);
}

namespace fs = std::filesystem;

class CopyJournal : public SmallJournal {
 protected:
  // A good, closed file with so many records.
  void expect_good(const fs::path& file, std::uint64_t records) const {
    const auto check = value_or_fail(check_journal(file));
    EXPECT_FALSE(check.broken);
    EXPECT_TRUE(check.state.closed);
    EXPECT_EQ(check.records, records);
    EXPECT_EQ(check.meta.case_id, "box");
  }
  const fs::path out = folder / "out.surgery";
};

TEST_F(CopyJournal, ARepairedFileIsTheValidPrefixAndTheOriginalIsUntouched) {
  write(path, 9);
  run_sql(path, "UPDATE record SET payload = x'01' WHERE id = 12");
  const std::string before = test_support::content_of(path);
  const auto repaired = value_or_fail(repair_journal(path, out));
  EXPECT_EQ(repaired.kept, 11u);
  EXPECT_EQ(repaired.of, 18u);
  ASSERT_TRUE(repaired.broken);
  EXPECT_THAT(repaired.broken->message, HasSubstr("record 12"));
  EXPECT_EQ(test_support::content_of(path), before);
  expect_good(out, 11);
  EXPECT_THAT(io::SurgeryFile::open(out)->meta().gap, HasSubstr("the valid prefix of a.surgery"));
  EXPECT_EQ(folder.entries(), 2u);
}

TEST_F(CopyJournal, ACutFileIsRepaired) {
  write(path, 30);
  fs::resize_file(path, fs::file_size(path) * 4 / 5);
  const auto repaired = value_or_fail(repair_journal(path, out));
  EXPECT_TRUE(repaired.broken);
  EXPECT_GT(repaired.kept, 5u);
  expect_good(out, repaired.kept);
}

TEST_F(CopyJournal, ACrashedFileBecomesAClosedOne) {
  auto live = value_or_fail(io::SurgeryFile::create(path, {.case_id = "box"}));
  ASSERT_TRUE(live.append(observation(1, "ius")));
  const auto repaired = value_or_fail(repair_journal(path, out));
  EXPECT_FALSE(repaired.broken);
  expect_good(out, 1);
}

TEST_F(CopyJournal, ATrimmedFileHoldsTheRangeWithItsUpdatesAndTruth) {
  {
    auto file = value_or_fail(io::SurgeryFile::create(path, {.case_id = "box"}));
    io::SurgeryTruth truth;
    for (std::uint64_t i = 1; i <= 9; ++i) {
      ASSERT_TRUE(file.append(observation(i, "ius")));
      ASSERT_TRUE(file.append(decision(i, Outcome::kUsed)));
      ASSERT_TRUE(file.append(update(100 + i, i)));
      truth.displacement = Points::Constant(3, 4, static_cast<double>(i));
      ASSERT_TRUE(file.write_truth(i, truth));
    }
    ASSERT_TRUE(file.close());
  }
  const auto trimmed = value_or_fail(trim_journal(path, 4, 6, out));
  EXPECT_EQ(trimmed.kept, 9u);
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
    EXPECT_THAT(refusal_of(result, code), HasSubstr(text));
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
    EXPECT_EQ(refusal_of(result, ErrorCode::kInvalidArgument), path.string() + ": exists already");
  }
  EXPECT_EQ(test_support::content_of(path), before);
  fs::create_symlink("nowhere", out);
  EXPECT_FALSE(repair_journal(path, out));
}

}  // namespace
}  // namespace brainshift::client
