// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/journal/record_sink.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::server {
namespace {

namespace fs = std::filesystem;
using test_support::TemporaryFolder;

TEST(JournalPath, KeepsTheCaseIdInsideTheFolder) {
  EXPECT_EQ(journal_path("/j", "../a b/c", "1"), "/j/.._a_b_c-1.surgery");
}

TEST(JournalPath, NeverNamesAFileThatExists) {
  const TemporaryFolder folder;
  const auto first = journal_path(folder.path(), "c", "1");
  ASSERT_TRUE(io::SurgeryFile::create(first, {}).has_value());
  const auto second = journal_path(folder.path(), "c", "1");
  EXPECT_EQ(second.filename(), "c-1-2.surgery");
}

TEST(JournalPath, NeverNamesAFileWhoseLogIsLeft) {
  const TemporaryFolder folder;
  folder.write("a.surgery-wal", "left behind");
  EXPECT_EQ(free_path(folder / "a.surgery"), folder / "a-2.surgery");
  folder.write("a-2.surgery", "");
  EXPECT_EQ(free_path(folder / "a.surgery"), folder / "a-3.surgery");
  EXPECT_EQ(free_path(folder / "a.surgery", folder / "a-3.surgery"), folder / "a-4.surgery");
  fs::create_symlink("nowhere", folder / "b.surgery");
  EXPECT_EQ(free_path(folder / "b.surgery"), folder / "b-2.surgery");
}

TEST(SurgeryFileSink, NoticesThatItsFileIsGone) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.surgery";
  auto sink = open_surgery_file(path, {});
  ASSERT_TRUE(sink) << sink.error().message;
  const std::vector<io::SurgeryRecord> records = {{io::RecordKind::kUpdate, 1, 0, "x"}};
  ASSERT_TRUE((*sink)->append(records));
  EXPECT_TRUE((*sink)->check());
  fs::remove(path);
  const Status status = (*sink)->check();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().message,
            path.string() + ": was deleted or replaced while it was recorded");
}

}  // namespace
}  // namespace brainshift::server
