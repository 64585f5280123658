// SPDX-License-Identifier: GPL-3.0-or-later
// What happens around a surgery file: read-only folders, files that are deleted or replaced.
#include "common/io/recording/sqlite_database.hpp"

#include <gmock/gmock.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <functional>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/recording/surgery_records.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class SurgeryOnDisk : public ::testing::Test {
 protected:
  void TearDown() override { fs::permissions(folder.path(), fs::perms::owner_all); }

  // A writer that keeps the log beside the file, as a crash does.
  SurgeryFile live(std::uint64_t records) const {
    auto file = value_or_fail(SurgeryFile::create(path, {.case_id = "c"}));
    for (std::uint64_t i = 1; i <= records; ++i) EXPECT_TRUE(file.append(numbered_record(i)));
    return file;
  }

  // The reason for a failure is all that the process with fewer rights can leave behind.
  static Result<SurgeryFile> opened(const fs::path& path) {
    auto file = SurgeryFile::open(path);
    if (!file) std::fprintf(stderr, "%s\n", file.error().message.c_str());
    return file;
  }
  // Runs `check` as somebody who may not write into the folder; its exit status. Root may write
  // everywhere, hence another user in a process of its own.
  int in_a_folder_for_reading(const std::function<bool()>& check) const {
    for (const auto& entry : fs::directory_iterator(folder.path())) {
      fs::permissions(entry.path(), static_cast<fs::perms>(0444));
    }
    fs::permissions(folder.path(), static_cast<fs::perms>(0555));
    const pid_t child = ::fork();
    if (child == 0) {
      constexpr uid_t kNobody = 65534;
      if (::geteuid() == 0 && ::setresuid(kNobody, kNobody, kNobody) != 0) ::_exit(3);
      ::_exit(check() ? 0 : 1);
    }
    int how = 0;
    EXPECT_EQ(::waitpid(child, &how, 0), child);
    return WIFEXITED(how) ? WEXITSTATUS(how) : -1;
  }

  const test_support::TemporaryFolder folder;
  const fs::path path = folder / "what? a #1%20.surgery";
};

// ---------- a disk that cannot be written ----------

TEST_F(SurgeryOnDisk, AClosedFileOpensWhereNothingCanBeWritten) {
  write_numbered(path, 3);
  EXPECT_EQ(in_a_folder_for_reading([&] {
              const auto file = opened(path);
              return file && visit_all(*file).records.size() == 3;
            }),
            0);
}

TEST_F(SurgeryOnDisk, ACrashedFileWithoutItsLogOpensWhereNothingCanBeWritten) {
  const fs::path copy = folder / "copy.surgery";
  {
    const SurgeryFile file = live(3);
    fs::copy_file(path, copy);
  }
  EXPECT_EQ(in_a_folder_for_reading([&] {
              const auto file = opened(copy);
              return file && !file->state().closed && visit_all(*file).status;
            }),
            0);
}

TEST_F(SurgeryOnDisk, ALogThatCannotBeReadIsNamed) {
  const fs::path copy = folder / "copy.surgery";
  {
    const SurgeryFile file = live(3);
    fs::copy_file(path, copy);
    fs::copy_file(fs::path(path) += "-wal", fs::path(copy) += "-wal");
  }
  EXPECT_EQ(in_a_folder_for_reading([&] {
              const auto file = opened(copy);
              return !file && file.error().message.find("copy both") != std::string::npos;
            }),
            0);
}

// ---------- deleted or replaced ----------

TEST_F(SurgeryOnDisk, AFileThatIsDeletedOrReplacedIsNoLongerInPlace) {
  SurgeryFile file = live(2);
  EXPECT_TRUE(file.in_place());
  fs::remove(path);
  EXPECT_FALSE(file.in_place());
  std::ofstream(path) << "somebody else's";
  EXPECT_FALSE(file.in_place());
  EXPECT_EQ(refusal_of(file.close(), ErrorCode::kWriteFailed),
            path.string() + ": was deleted, replaced or cut while it was written");
  EXPECT_EQ(test_support::content_of(path), "somebody else's");
}

TEST_F(SurgeryOnDisk, ALogThatIsDeletedOrReplacedIsNoticedToo) {
  for (const bool replace : {false, true}) {
    fs::remove(path);
    SurgeryFile file = live(2);
    const fs::path log = fs::path(path) += "-wal";
    ASSERT_TRUE(fs::exists(log));
    fs::remove(log);
    if (replace) std::ofstream(log) << "somebody else's";
    EXPECT_FALSE(file.in_place());
    EXPECT_FALSE(file.close());
    EXPECT_EQ(fs::exists(log), replace);
    fs::remove(log);
  }
}

TEST_F(SurgeryOnDisk, NeitherClosingNorDroppingAReplacedFileTouchesItsSuccessor) {
  for (const bool close : {false, true}) {
    discard_surgery(path);
    SurgeryFile successor = [&] {
      SurgeryFile file = live(2);
      discard_surgery(path);
      SurgeryFile next = live(3);
      if (close) {
        EXPECT_FALSE(file.close());
      }
      return next;
    }();
    EXPECT_TRUE(successor.in_place());
    EXPECT_TRUE(successor.append(numbered_record(4)));
    EXPECT_TRUE(successor.close());
    EXPECT_EQ(visit_all(*SurgeryFile::open(path)).records.size(), 4u);
  }
}

// SQLite maps the index of the log: a part that is cut off ends the process when it is used.
TEST_F(SurgeryOnDisk, ALogOrIndexThatIsCutIsNoticedBeforeItIsUsed) {
  for (const char* suffix : {"-wal", "-shm"}) {
    fs::remove(path);
    SurgeryFile file = live(2);
    EXPECT_TRUE(file.in_place());
    fs::resize_file(fs::path(path) += suffix, 100);
    EXPECT_FALSE(file.in_place()) << suffix;
    EXPECT_FALSE(file.close());
    fs::remove(fs::path(path) += suffix);
  }
}

TEST_F(SurgeryOnDisk, AViewInThePlaceOfATableIsRefusedAtOnce) {
  ASSERT_TRUE(live(2).close());
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(db,
                         "DROP TABLE record; CREATE VIEW record AS WITH RECURSIVE endless(id) AS "
                         "(SELECT 1 UNION ALL SELECT id + 1 FROM endless) SELECT id, 'update' AS "
                         "kind, id AS sequence, 0 AS recorded_ns, '' AS payload, 0 AS crc FROM "
                         "endless",
                         nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(db);
  refusal_of(SurgeryFile::open(path), ErrorCode::kUnreadable);
  const auto damaged = SurgeryFile::open_damaged(path);
  EXPECT_FALSE(damaged && damaged->visit([](const auto&) { return Status(); }));
}

TEST_F(SurgeryOnDisk, AJournalIsItsOwnersAlone) {
  const mode_t before = umask(0);
  SurgeryFile file = live(1);
  for (const char* suffix : {"", "-wal", "-shm"}) {
    struct stat status {};
    ASSERT_EQ(stat((fs::path(path) += suffix).c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u) << suffix;
  }
  umask(before);
}

}  // namespace
}  // namespace brainshift::io
