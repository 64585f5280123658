// SPDX-License-Identifier: GPL-3.0-or-later
// The journal on a real disk that fails: full, deleted under it, syncs that fail, killed.
#include <gmock/gmock.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>
#include <random>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/server/journal/journal_fakes.hpp"

namespace brainshift::server {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::uint64_t> sequences_in(const fs::path& path) {
  const auto file = value_or_fail(io::SurgeryFile::open(path));
  std::vector<std::uint64_t> sequences;
  for (const auto& each : value_or_fail(file.records(io::RecordKind::kObservation))) {
    sequences.push_back(each.sequence);
  }
  return sequences;
}

// ---------- deleted, replaced ----------

class JournalOnDisk : public testing::Test {
 protected:
  // The daemon's own times.
  Journal::Options options() {
    Journal::Options options;
    options.resume_free_bytes = 0;
    witness.watch(options);
    return options;
  }
  bool sees_recorded(std::uint64_t sequence) {
    return witness.sees([=](const Recorded& r) { return holds(r, "ius", sequence); });
  }

  const test_support::TemporaryFolder folder;
  const fs::path path = folder / "a.surgery", next = folder / "a-2.surgery";
  Witness witness;
};

TEST_F(JournalOnDisk, ADeletedFileIsReportedWithinASecondAndRecordingGoesOnInANewOne) {
  Journal journal(options());
  journal.begin(path, {.case_id = "c"});
  journal.append(record(1), "ius");
  ASSERT_TRUE(sees_recorded(1));
  const auto deleted = std::chrono::steady_clock::now();
  fs::remove(path);
  ASSERT_TRUE(witness.sees_errors(1));
  EXPECT_LT(std::chrono::steady_clock::now() - deleted, std::chrono::seconds(1));
  EXPECT_THAT(witness.errors(),
              ElementsAre(path.string() + ": was deleted, replaced or cut while it was recorded"));
  ASSERT_TRUE(witness.sees_resumption());
  EXPECT_FALSE(holds(journal.recorded(), "ius", 1)) << "it went with its file";
  journal.append(record(2), "ius");
  ASSERT_TRUE(sees_recorded(2));
  journal.stop();
  EXPECT_THAT(sequences_in(next), ElementsAre(2));
  const auto meta = io::SurgeryFile::open(next)->meta();
  EXPECT_EQ(meta.case_id, "c");
  EXPECT_EQ(meta.continues, "a.surgery");
  EXPECT_THAT(meta.gap, HasSubstr("was deleted"));
  EXPECT_THAT(meta.gap, HasSubstr("observations 1 of ius (1)"));
  EXPECT_FALSE(fs::exists(path));
}

TEST_F(JournalOnDisk, SessionsInWhichNothingWasObservedLeaveNoFile) {
  Journal journal(options());
  constexpr int kStarts = 200;
  for (int i = 0; i < kStarts; ++i) {
    journal.begin(folder / ("s" + std::to_string(i) + ".surgery"), {});
  }
  journal.begin(path, {});
  journal.append(record(1), "ius");
  ASSERT_TRUE(sees_recorded(1));
  journal.begin(folder / "last.surgery", {});
  journal.stop();
  EXPECT_EQ(folder.entries(), 1u);
  EXPECT_THAT(sequences_in(path), ElementsAre(1));
}

TEST_F(JournalOnDisk, AFileInThePlaceOfTheJournalIsLeftAlone) {
  Journal journal(options());
  journal.begin(path, {});
  journal.append(record(1), "ius");
  ASSERT_TRUE(sees_recorded(1));
  fs::remove(path);
  std::ofstream(path) << "somebody else's";
  ASSERT_TRUE(witness.sees_resumption());
  journal.append(record(2), "ius");
  journal.stop();
  EXPECT_EQ(test_support::content_of(path), "somebody else's");
  EXPECT_THAT(sequences_in(next), ElementsAre(2));
}

TEST_F(JournalOnDisk, AFolderThatGoesAndComesBackIsRecordedToAgain) {
  Journal::Options quick = options();
  quick.check_interval = quick.retry_interval = std::chrono::milliseconds(1);
  Journal journal(quick);
  const fs::path gone = folder / "disk";
  fs::create_directory(gone);
  journal.begin(gone / "a.surgery", {});
  journal.append(record(1), "ius");
  ASSERT_TRUE(sees_recorded(1));
  fs::rename(gone, folder / "elsewhere");
  ASSERT_TRUE(witness.sees_errors(1));
  EXPECT_FALSE(journal.status().has_value());
  fs::create_directory(gone);
  ASSERT_TRUE(witness.sees_resumption());
  EXPECT_TRUE(journal.status().has_value());
  journal.append(record(2), "ius");
  ASSERT_TRUE(sees_recorded(2));
  journal.stop();
  EXPECT_THAT(sequences_in(gone / "a-2.surgery"), ElementsAre(2));
}

// ---------- syncs that fail ----------

// SQLite's own file system, whose syncs fail while `failing` is set. Installed for all files that
// are opened as long as it lives.
class FailingSync {
 public:
  static inline std::atomic<bool> failing{false};

  FailingSync() {
    below_ = sqlite3_vfs_find(nullptr);
    vfs_ = *below_;
    vfs_.zName = "failing-sync";
    vfs_.xOpen = open;
    sqlite3_vfs_register(&vfs_, 1);
  }
  ~FailingSync() {
    sqlite3_vfs_unregister(&vfs_);
    sqlite3_vfs_register(below_, 1);
    failing = false;
  }

 private:
  static int open(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* out_flags) {
    const int rc = below_->xOpen(below_, name, file, flags, out_flags);
    if (rc != SQLITE_OK || file->pMethods == nullptr) return rc;
    auto& methods = methods_[file->pMethods];
    methods = *file->pMethods;
    real_sync_ = methods.xSync;  // the same function for every kind of file
    methods.xSync = sync;
    file->pMethods = &methods;
    return rc;
  }
  static int sync(sqlite3_file* file, int flags) {
    return failing ? SQLITE_IOERR_FSYNC : real_sync_(file, flags);
  }

  static inline sqlite3_vfs* below_ = nullptr;
  static inline sqlite3_vfs vfs_;
  static inline std::map<const sqlite3_io_methods*, sqlite3_io_methods> methods_;
  static inline int (*real_sync_)(sqlite3_file*, int) = nullptr;
};

TEST_F(JournalOnDisk, NothingIsRecordedWhileSyncsFailAndRecordingGoesOnAfterwards) {
  const FailingSync storage;
  Journal::Options quick = options();
  quick.retry_interval = std::chrono::milliseconds(1);
  Journal journal(quick);
  journal.begin(path, {});
  journal.append(record(1), "ius");
  ASSERT_TRUE(sees_recorded(1));
  FailingSync::failing = true;
  journal.append(record(2), "ius");
  ASSERT_TRUE(witness.sees_errors(1));
  EXPECT_THAT(witness.errors().front(), HasSubstr(path.string() + ": cannot write record"));
  EXPECT_FALSE(journal.status().has_value());
  EXPECT_FALSE(holds(journal.recorded(), "ius", 2));
  FailingSync::failing = false;
  ASSERT_TRUE(witness.sees_resumption());
  journal.append(record(3), "ius");
  ASSERT_TRUE(sees_recorded(3));
  journal.stop();
  EXPECT_THAT(sequences_in(path), testing::AnyOf(ElementsAre(1), ElementsAre(1, 2)));
  EXPECT_THAT(sequences_in(next), testing::AnyOf(ElementsAre(3), ElementsAre(2, 3)));
}

// ---------- full ----------

// A file-size limit stands for a full disk. It holds for the whole process, hence the child.
void journal_on_a_full_disk(const fs::path& path) {
  std::signal(SIGXFSZ, SIG_IGN);
  Witness witness;
  Journal::Options options;
  witness.watch(options);
  Journal journal(options);
  journal.begin(path, io::SurgeryMeta{"c"});
  journal.append(record(1), "ius");
  if (!witness.sees([](const Recorded& r) { return holds(r, "ius", 1); })) std::exit(1);
  const rlimit limit{128 * 1024, 128 * 1024};
  setrlimit(RLIMIT_FSIZE, &limit);
  journal.append({io::RecordKind::kUpdate, 2, 0, std::string(1 << 20, 'a')});
  journal.stop();
  std::exit(journal.status() ? 0 : 42);
}

TEST(JournalDeathTest, AFullDiskIsReportedAndLeavesAReadableFile) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  // The dying process runs this test from its start: it must find the folder of the one that
  // watches.
  constexpr const char* kVariable = "BRAINSHIFT_FULL_DISK_FOLDER";
  std::optional<test_support::TemporaryFolder> folder;
  if (getenv(kVariable) == nullptr) setenv(kVariable, folder.emplace().path().c_str(), 1);
  const auto path = fs::path(getenv(kVariable)) / "j.surgery";
  EXPECT_EXIT(journal_on_a_full_disk(path), testing::ExitedWithCode(42), "");
  EXPECT_THAT(sequences_in(path), ElementsAre(1));
  EXPECT_EQ(io::SurgeryFile::open(path)->records(io::RecordKind::kUpdate)->size(), 0u);
  EXPECT_FALSE(fs::exists(fs::path(getenv(kVariable)) / "j-2.surgery"))
      << "a file that could not take the record must not stay";
}

// ---------- killed ----------

// Says over a pipe what the journal calls recorded, until it is killed.
[[noreturn]] void record_until_killed(const fs::path& path, int pipe) {
  Journal::Options options;
  options.on_recorded = [pipe](const Recorded& recorded) {
    const auto found = recorded.held.observations.find("ius");
    const std::uint64_t last = found == recorded.held.observations.end() ? 0 : found->second.last;
    if (::write(pipe, &last, sizeof(last)) != sizeof(last)) ::_exit(1);
  };
  Journal journal(options);
  journal.begin(path, {});
  for (std::uint64_t i = 1;; ++i) {
    journal.append({io::RecordKind::kObservation, i, 0, std::string(2000, 'x')}, "ius");
    // Flooded, yet not beyond the queue.
    const auto held = [&] { return journal.recorded().held.observations["ius"].last; };
    while (i - held() > 2000) std::this_thread::yield();
  }
}

TEST(JournalKilled, WhatWasCalledRecordedIsThere) {
  std::mt19937 random(3);
  std::uint64_t called_recorded = 0;
  for (int kill = 0; kill < 10; ++kill) {
    const test_support::TemporaryFolder folder;
    const fs::path path = folder / "a.surgery";
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) record_until_killed(path, ends[1]);
    ::close(ends[1]);
    // Killed after a random number of commits, wherever it is then.
    std::uint64_t last = 0;
    const auto commits = 2 + random() % 8;
    for (std::size_t i = 0; i < commits; ++i) {
      ASSERT_EQ(::read(ends[0], &last, sizeof(last)), static_cast<ssize_t>(sizeof(last)));
    }
    ::kill(child, SIGKILL);
    while (::read(ends[0], &last, sizeof(last)) == static_cast<ssize_t>(sizeof(last))) {
    }
    ::close(ends[0]);
    int how = 0;
    ASSERT_EQ(::waitpid(child, &how, 0), child);
    ASSERT_TRUE(WIFSIGNALED(how));
    const auto sequences = sequences_in(path);
    ASSERT_GE(sequences.size(), last);
    for (std::size_t i = 0; i < sequences.size(); ++i) ASSERT_EQ(sequences[i], i + 1);
    called_recorded += last;
  }
  EXPECT_GT(called_recorded, 0u);
}

}  // namespace
}  // namespace brainshift::server
