// SPDX-License-Identifier: GPL-3.0-or-later
// Stand-ins for the tests of the journal: a storage that fails and stalls when told to, and a
// witness of what the journal tells.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/journal/journal.hpp"

namespace brainshift::server {

// Long enough for a slow machine; a test that waits this long has failed.
inline constexpr std::chrono::seconds kPatience{30};

// Used by the journal's thread, set and read by the test's.
class FakeStorage {
 public:
  struct File {
    std::filesystem::path path;
    JournalMeta meta;
    std::vector<std::vector<std::uint64_t>> groups;  // sequences, by commit
    bool closed = false;
  };

  OpenSink opener();
  // Each is asked with the number of the attempt, from 1; an error is the storage's answer. They
  // may block.
  std::function<Status(int)> on_open = [](int) { return Status(); };
  std::function<Status(int)> on_append = [](int) { return Status(); };
  std::function<Status()> on_check = [] { return Status(); };

  std::vector<File> files() {
    const std::lock_guard lock(mutex_);
    return files_;
  }

 private:
  class Sink;
  std::mutex mutex_;
  std::vector<File> files_;
  int opens_ = 0, appends_ = 0;
};

class FakeStorage::Sink final : public RecordSink {
 public:
  Sink(FakeStorage& storage, std::size_t file) : storage_(storage), file_(file) {}
  Status append(std::span<const io::SurgeryRecord> records) override {
    if (Status ok = storage_.on_append(++storage_.appends_); !ok) return ok;
    std::vector<std::uint64_t> group;
    for (const io::SurgeryRecord& record : records) group.push_back(record.sequence);
    const std::lock_guard lock(storage_.mutex_);
    storage_.files_[file_].groups.push_back(std::move(group));
    return {};
  }
  Status check() override { return storage_.on_check(); }
  Status close() override {
    const std::lock_guard lock(storage_.mutex_);
    storage_.files_[file_].closed = true;
    return {};
  }

 private:
  FakeStorage& storage_;
  std::size_t file_;
};

inline OpenSink FakeStorage::opener() {
  return [this](const std::filesystem::path& path,
                const JournalMeta& meta) -> Result<std::unique_ptr<RecordSink>> {
    if (Status ok = on_open(++opens_); !ok) return tl::unexpected(ok.error());
    const std::lock_guard lock(mutex_);
    files_.push_back({path, meta, {}, false});
    return std::make_unique<Sink>(*this, files_.size() - 1);
  };
}

// Whether an accepted observation is on the disk. After a loss, those before it count as lost.
inline bool holds(const Recorded& recorded, const std::string& source, std::uint64_t sequence) {
  const auto written = recorded.held.observations.find(source);
  if (written == recorded.held.observations.end() || sequence > written->second.last) return false;
  const auto lost = recorded.missing.observations.find(source);
  return lost == recorded.missing.observations.end() || sequence > lost->second.last;
}

// What the journal told; may be asked while it runs.
class Witness {
 public:
  // Adds itself to the options.
  void watch(Journal::Options& options) {
    options.on_error = [this](const Error& error) {
      change([&] { errors_.push_back(error.message); });
    };
    options.on_resumed = [this](const std::filesystem::path& path) {
      change([&] { resumed_.push_back(path.filename()); });
    };
    options.on_recorded = [this](const Recorded& recorded) { change([&] { last_ = recorded; }); };
  }
  // Whether the journal comes to tell what satisfies the condition.
  bool sees(const std::function<bool(const Recorded&)>& condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return condition(last_); });
  }
  bool sees_errors(std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return errors_.size() >= count; });
  }
  bool sees_resumption() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return !resumed_.empty(); });
  }
  std::vector<std::string> errors() {
    const std::lock_guard lock(mutex_);
    return errors_;
  }
  std::vector<std::string> resumed() {
    const std::lock_guard lock(mutex_);
    return resumed_;
  }

 private:
  template <typename Function>
  void change(Function&& function) {
    {
      const std::lock_guard lock(mutex_);
      function();
    }
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  Recorded last_;
  std::vector<std::string> errors_, resumed_;
};

inline io::SurgeryRecord record(std::uint64_t sequence,
                                io::RecordKind kind = io::RecordKind::kObservation) {
  return {kind, sequence, 0, "payload " + std::to_string(sequence)};
}

// Options with short times: a test that waits for a retry waits for moments.
inline Journal::Options quick_options(FakeStorage& storage, Witness& witness) {
  Journal::Options options;
  options.open = storage.opener();
  options.commit_interval = std::chrono::milliseconds(0);
  options.check_interval = std::chrono::milliseconds(1);
  options.retry_interval = std::chrono::milliseconds(1);
  options.resume_free_bytes = 0;
  witness.watch(options);
  return options;
}

inline Status disk_full() { return fail(ErrorCode::kWriteFailed, "x: disk full"); }

}  // namespace brainshift::server
