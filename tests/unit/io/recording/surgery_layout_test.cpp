// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/surgery_layout.hpp"

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <vector>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/recording/surgery_records.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class SurgeryLayout : public ::testing::Test {
 protected:
  SurgeryState state() const { return value_or_fail(SurgeryFile::open(path)).state(); }
  // A process that is killed after its last record.
  void crash_after(std::uint64_t records) const {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      auto file = SurgeryFile::create(path, {.case_id = "c"});
      for (std::uint64_t i = 1; file && i <= records; ++i) {
        if (!file->append(numbered_record(i))) ::_exit(1);
      }
      ::kill(::getpid(), SIGKILL);
    }
    int how = 0;
    ASSERT_EQ(::waitpid(child, &how, 0), child);
    ASSERT_TRUE(WIFSIGNALED(how));
  }

  const test_support::TemporaryFolder folder;
  const fs::path path = folder / "one.surgery";
};

// ---------- closed or not ----------

TEST_F(SurgeryLayout, AClosedFileSaysHowManyRecordsItHas) {
  write_numbered(path, 5);
  EXPECT_TRUE(state().closed);
  EXPECT_EQ(state().records, 5u);
  EXPECT_EQ(describe(state()), "5 records, closed");
}

TEST_F(SurgeryLayout, ACrashedFileSaysThatItWasNotClosed) {
  crash_after(5);
  const SurgeryState crashed = state();
  EXPECT_FALSE(crashed.closed);
  EXPECT_TRUE(crashed.log_beside);
  EXPECT_EQ(crashed.records, 5u);
  EXPECT_THAT(describe(crashed), HasSubstr("5 records, not closed"));
}

TEST_F(SurgeryLayout, ACopyWithoutItsLogIsASurgeryThatSaysThatItWasNotClosed) {
  crash_after(5);
  const fs::path copy = folder / "copy.surgery";
  fs::copy_file(path, copy);
  const auto file = value_or_fail(SurgeryFile::open(copy));
  EXPECT_EQ(file.meta().case_id, "c");
  EXPECT_FALSE(file.state().closed);
  EXPECT_FALSE(file.state().log_beside);
  const Visited visited = visit_all(file);
  EXPECT_TRUE(visited.status) << visited.status.error().message;
  EXPECT_LT(visited.records.size(), 5u);
  EXPECT_EQ(visited.records.size(), file.state().records);
  EXPECT_THAT(describe(file.state()), HasSubstr("its end is missing if"));
}

TEST_F(SurgeryLayout, ALiveFileIsNotClosedAndAnAddedOneNoLonger) {
  auto file = value_or_fail(SurgeryFile::create(path, {}));
  EXPECT_FALSE(state().closed);
  ASSERT_TRUE(file.close());
  EXPECT_TRUE(file.state().closed);
  EXPECT_TRUE(state().closed);
  auto added = value_or_fail(SurgeryFile::open_to_append(path));
  EXPECT_TRUE(state().closed) << "nothing was added";
  ASSERT_TRUE(added.append(numbered_record(1)));
  EXPECT_FALSE(state().closed);
  EXPECT_FALSE(added.state().closed);
  ASSERT_TRUE(added.close());
  EXPECT_TRUE(state().closed);
  EXPECT_EQ(state().records, 1u);
}

TEST_F(SurgeryLayout, AFileThatWasOpenedToAddToAndGivenUpIsStillClosed) {
  write_numbered(path, 3);
  { const auto given_up = SurgeryFile::open_to_append(path); }
  EXPECT_TRUE(state().closed);
  EXPECT_EQ(state().records, 3u);
}

TEST_F(SurgeryLayout, AClosedFileThatLostItsLastRecordsIsRefused) {
  write_numbered(path, 20);
  run_sql(path, "DELETE FROM record WHERE id > 18");
  EXPECT_THAT(sentence_of(SurgeryFile::open(path)),
              HasSubstr("was closed with 20 records, but holds 18"));
  const auto damaged = value_or_fail(SurgeryFile::open_damaged(path));
  const Visited visited = visit_all(damaged);
  EXPECT_EQ(visited.records.size(), 18u);
  EXPECT_TRUE(is_prefix(visited.records));
  EXPECT_THAT(sentence_of(visited.status), HasSubstr("record 19: is missing"));
}

// ---------- groups ----------

TEST_F(SurgeryLayout, AGroupOfRecordsIsKeptAsAWholeOrNotAtAll) {
  auto file = value_or_fail(SurgeryFile::create(path, {}));
  std::vector<SurgeryRecord> group = {numbered_record(1), numbered_record(2), numbered_record(3)};
  ASSERT_TRUE(file.append(group));
  std::vector<SurgeryRecord> bad = {numbered_record(4), numbered_record(5)};
  bad[1].sequence = 1ull << 63;
  EXPECT_FALSE(file.append(bad));
  EXPECT_EQ(file.state().records, 3u);
  ASSERT_TRUE(file.append(numbered_record(4)));
  ASSERT_TRUE(file.close());
  const Visited visited = visit_all(*SurgeryFile::open(path));
  EXPECT_TRUE(visited.status);
  EXPECT_EQ(visited.records.size(), 4u);
  EXPECT_TRUE(is_prefix(visited.records));
}

TEST_F(SurgeryLayout, ATableOrColumnThatItsVersionNeedsMustBeThere) {
  for (const char* sql :
       {"DROP TABLE seal", "ALTER TABLE record DROP COLUMN crc", "DROP TABLE truth_scalar",
        "ALTER TABLE truth_field DROP COLUMN crc", "DELETE FROM seal WHERE name = 'meta'"}) {
    fs::remove(path);
    write_numbered(path, 1);
    run_sql(path, sql);
    const auto file = SurgeryFile::open(path);
    ASSERT_FALSE(file) << sql;
    EXPECT_EQ(file.error().code, ErrorCode::kUnreadable);
  }
}

}  // namespace
}  // namespace brainshift::io
