// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/journal/journal_check.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/unit/client/tools/journal/small_journal.hpp"

namespace brainshift::client {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

class CheckJournal : public SmallJournal {};

TEST_F(CheckJournal, CountsWhatAGoodFileHolds) {
  write(path, 9);
  const auto check = check_journal(path);
  ASSERT_TRUE(check) << check.error().message;
  EXPECT_FALSE(check->broken);
  EXPECT_EQ(check->records, 18u);
  EXPECT_EQ(check->observations.at("ius").count, 6u);
  EXPECT_EQ(check->observations.at("camera").first, 3u);
  EXPECT_EQ(check->observations.at("camera").last, 9u);
  EXPECT_EQ(check->updates.count, 9u);
  const auto lines = report_lines(*check);
  EXPECT_EQ(lines[0], path.string() + ": 18 records, closed");
  EXPECT_THAT(lines, Contains("  observations 6 (1 to 8, 2 numbers left out) of ius"));
  EXPECT_THAT(lines, Contains("  updates      9 (1 to 9)"));
  EXPECT_THAT(lines, Contains("  checksums    all match"));
}

TEST_F(CheckJournal, DecisionsAreCountedByOutcome) {
  {
    auto file = io::SurgeryFile::create(path, {});
    ASSERT_TRUE(file);
    for (std::uint64_t i = 1; i <= 5; ++i) {
      const auto outcome = i < 4 ? Outcome::kUsed : Outcome::kSkipped;
      ASSERT_TRUE(file->append(decision(i, outcome)));
    }
    ASSERT_TRUE(file->append({io::RecordKind::kDecision, 6, 0, "\xff\xff"}));
    ASSERT_TRUE(file->close());
  }
  const auto check = check_journal(path);
  ASSERT_TRUE(check);
  EXPECT_THAT(report_lines(*check), Contains("  decisions    2 skipped, 3 used"));
  ASSERT_TRUE(check->broken);
  EXPECT_THAT(check->broken->message, HasSubstr("record 6: decision 6: "));
}

TEST_F(CheckJournal, NamesTheFirstBadRecordAndCountsWhatIsInFrontOfIt) {
  write(path, 9);
  run_sql(path, "UPDATE record SET recorded_ns = 0 WHERE id = 7");
  const auto check = check_journal(path);
  ASSERT_TRUE(check);
  ASSERT_TRUE(check->broken);
  EXPECT_THAT(check->broken->message, HasSubstr(path.string() + ": record 7: "));
  EXPECT_EQ(check->records, 6u);
  EXPECT_THAT(report_lines(*check), Contains("  valid        the first 6 of 18 records"));
  EXPECT_THAT(report_lines(*check), Not(Contains(HasSubstr("all match"))));
}

TEST_F(CheckJournal, APayloadThatNobodyCanDecodeIsBad) {
  {
    auto file = io::SurgeryFile::create(path, {});
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->append(observation(1, "ius")));
    ASSERT_TRUE(file->append({io::RecordKind::kUpdate, 5, 0, "\xff\xff"}));
    ASSERT_TRUE(file->close());
  }
  const auto check = check_journal(path);
  ASSERT_TRUE(check && check->broken);
  EXPECT_THAT(check->broken->message, HasSubstr("record 2: update 5: "));
  EXPECT_EQ(check->records, 1u);
}

TEST_F(CheckJournal, AFileThatWasNotClosedIsGoodAndSaysSo) {
  auto file = io::SurgeryFile::create(path, {.continues = "b.surgery", .gap = "disk full"});
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->append(observation(1, "ius")));
  const auto check = check_journal(path);
  ASSERT_TRUE(check);
  EXPECT_FALSE(check->broken);
  const auto lines = report_lines(*check);
  EXPECT_THAT(lines[0], HasSubstr("1 record, not closed"));
  EXPECT_THAT(lines, Contains("  goes on from b.surgery"));
  EXPECT_THAT(lines, Contains("  gap          disk full"));
}

TEST_F(CheckJournal, ACutFileIsBrokenAndWhatIsLeftIsCounted) {
  write(path, 30);
  // The tables themselves take the first half.
  std::filesystem::resize_file(path, std::filesystem::file_size(path) * 4 / 5);
  const auto check = check_journal(path);
  ASSERT_TRUE(check) << check.error().message;
  ASSERT_TRUE(check->broken);
  EXPECT_GT(check->records, 5u);
  EXPECT_LT(check->records, 60u);
}

TEST_F(CheckJournal, WhatIsNoSurgeryFileIsAnError) {
  EXPECT_EQ(check_journal(path).error().code, ErrorCode::kNotFound);
  std::ofstream(path) << "text";
  EXPECT_EQ(check_journal(path).error().code, ErrorCode::kUnreadable);
}

}  // namespace
}  // namespace brainshift::client
