// SPDX-License-Identifier: GPL-3.0-or-later
// What the journal calls recorded survives a power cut: on a disk that keeps what was synced, and
// of the rest whatever it likes.
#include <gmock/gmock.h>
#include <sqlite3.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/study_record.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/server/journal/journal_fakes.hpp"

namespace brainshift::server {
namespace {

namespace fs = std::filesystem;

// SQLite's own file system, which also keeps what a disk would hold after a cut. Installed for all
// files that are opened as long as it lives. One thread at a time uses it.
class LossyDisk {
 public:
  // The power fails at this write; at_cut is called then.
  LossyDisk(std::uint64_t cut_at, std::uint32_t seed, std::function<void()> at_cut)
      : cut_at_(cut_at), random_(seed), at_cut_(std::move(at_cut)) {
    disk_ = this;
    below_ = sqlite3_vfs_find(nullptr);
    vfs_ = *below_;
    vfs_.zName = "lossy-disk";
    vfs_.xOpen = open;
    vfs_.xDelete = remove;
    sqlite3_vfs_register(&vfs_, 1);
  }
  ~LossyDisk() {
    sqlite3_vfs_unregister(&vfs_);
    sqlite3_vfs_register(below_, 1);
    disk_ = nullptr;
  }

  bool has_failed() const { return failed_; }
  // The files as they are found when power is back.
  void write_into(const fs::path& folder) const {
    for (const auto& [path, file] : files_) {
      std::ofstream(folder / fs::path(path).filename(), std::ios::binary) << file.kept;
    }
  }

 private:
  struct Write {
    std::size_t offset = 0;
    std::string bytes;
  };
  struct File {
    std::string kept;           // synced
    std::vector<Write> unsure;  // written since
    bool deleted = false;       // for certain with the next sync, which includes the folder
  };

  static void apply(const Write& write, std::string& bytes) {
    bytes.resize(std::max(bytes.size(), write.offset + write.bytes.size()));
    std::copy(write.bytes.begin(), write.bytes.end(),
              bytes.begin() + static_cast<std::ptrdiff_t>(write.offset));
  }
  bool coin() { return random_() % 2 == 0; }
  void fail() {
    failed_ = true;
    std::erase_if(files_, [&](const auto& each) { return each.second.deleted && coin(); });
    for (auto& [path, file] : files_) {
      for (const Write& write : file.unsure) {
        if (coin()) apply(write, file.kept);
      }
    }
    at_cut_();
  }

  static int open(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* out_flags) {
    const int rc = below_->xOpen(below_, name, file, flags, out_flags);
    if (rc != SQLITE_OK || file->pMethods == nullptr || name == nullptr) return rc;
    disk_->open_files_[file] = name;
    auto& [real, ours] = methods_[file->pMethods];
    real = file->pMethods;
    ours = *real;
    ours.xWrite = write;
    ours.xSync = sync;
    real_of_[&ours] = real;
    file->pMethods = &ours;
    return rc;
  }
  static int write(sqlite3_file* file, const void* data, int size, sqlite3_int64 offset) {
    LossyDisk& disk = *disk_;
    if (!disk.failed_) {
      File& image = disk.files_[disk.open_files_[file]];
      if (image.deleted) image = {};  // a new file of the same name
      image.unsure.push_back(
          {static_cast<std::size_t>(offset),
           std::string(static_cast<const char*>(data), static_cast<std::size_t>(size))});
      if (++disk.writes_ == disk.cut_at_) disk.fail();
    }
    return real_of_[file->pMethods]->xWrite(file, data, size, offset);
  }
  static int sync(sqlite3_file* file, int) {
    LossyDisk& disk = *disk_;
    if (disk.failed_) return SQLITE_OK;
    File& image = disk.files_[disk.open_files_[file]];
    for (const Write& write : image.unsure) apply(write, image.kept);
    image.unsure.clear();
    std::erase_if(disk.files_, [](const auto& each) { return each.second.deleted; });
    return SQLITE_OK;  // nothing real is cut off
  }

  static int remove(sqlite3_vfs*, const char* name, int sync_folder) {
    const auto found = disk_->files_.find(name);
    if (!disk_->failed_ && found != disk_->files_.end()) found->second.deleted = true;
    return below_->xDelete(below_, name, sync_folder);
  }

  struct Methods {
    const sqlite3_io_methods* real = nullptr;
    sqlite3_io_methods ours;
  };
  static inline LossyDisk* disk_ = nullptr;
  static inline sqlite3_vfs* below_ = nullptr;
  static inline sqlite3_vfs vfs_;
  static inline std::map<const sqlite3_io_methods*, Methods> methods_;
  static inline std::map<const sqlite3_io_methods*, const sqlite3_io_methods*> real_of_;

  const std::uint64_t cut_at_;
  std::mt19937 random_;
  const std::function<void()> at_cut_;
  std::uint64_t writes_ = 0;
  bool failed_ = false;
  std::map<sqlite3_file*, std::string> open_files_;
  std::map<std::string, File> files_;
};

constexpr int kCuts = 100;

TEST(PowerCut, WhatWasCalledRecordedIsThere) {
  std::mt19937 random(5);
  std::uint64_t claimed = 0;
  int cuts = 0, lost = 0;
  // A run that ends before its cut does not count.
  for (std::uint32_t run = 0; cuts < kCuts && run < 4 * kCuts; ++run) {
    const test_support::TemporaryFolder folder;
    fs::create_directory(folder / "before");
    fs::create_directory(folder / "after");
    std::uint64_t recorded = 0;
    Journal* writer = nullptr;
    // About 30 writes make the file, about 4,000 the records and two checkpoints.
    LossyDisk disk(1 + random() % (run % 4 == 0 ? 60 : 4000), run, [&] {
      const auto held = writer->recorded().held.observations;
      recorded = held.contains("ius") ? held.at("ius").last : 0;
    });
    {
      Journal::Options options;
      options.commit_interval = std::chrono::milliseconds(0);
      Journal journal(options);
      writer = &journal;
      journal.begin(folder / "before" / "a.surgery", {});
      for (std::uint64_t i = 1; i <= 1500; ++i) {
        journal.append({io::RecordKind::kObservation, i, 0, std::string(4000, 'x')}, "ius");
        // Many groups, not one.
        const auto held = [&] { return journal.recorded().held.observations["ius"].last; };
        while (i - held() > 40) std::this_thread::yield();
      }
      journal.stop();
      ASSERT_TRUE(journal.status()) << journal.status().error().message;
    }
    if (!disk.has_failed()) continue;
    ++cuts;
    disk.write_into(folder / "after");
    const auto file = io::SurgeryFile::open(folder / "after" / "a.surgery");
    std::uint64_t found = 0;
    if (file) {
      const Status whole = file->visit([&](const io::SurgeryRecord& record) {
        EXPECT_EQ(record.sequence, ++found);
        return Status();
      });
      EXPECT_TRUE(whole) << whole.error().message;
    }
    EXPECT_GE(found, recorded) << "cut " << run << (file ? "" : ": " + file.error().message);
    claimed += recorded;
    if (found < recorded) lost += static_cast<int>(recorded - found);
  }
  std::printf("%d cuts, %llu observations were called recorded\n", cuts,
              static_cast<unsigned long long>(claimed));
  const std::string by = "unit_server_journal --gtest_filter=PowerCut.*";
  EXPECT_TRUE(test_support::record_check("power-cuts", "power cuts", cuts,
                                         "= " + std::to_string(kCuts), cuts == kCuts, by));
  EXPECT_TRUE(test_support::record_check("power-cuts", "observations called recorded and lost",
                                         lost, "= 0", lost == 0, by));
  test_support::record_figure("power-cuts", "observations called recorded before a cut",
                              static_cast<double>(claimed), "shown", by);
  EXPECT_GT(claimed, 1000u);
}

}  // namespace
}  // namespace brainshift::server
