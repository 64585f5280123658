// SPDX-License-Identifier: GPL-3.0-or-later
// Journal: every accepted observation and every final update, appended to a surgery file by a
// thread of its own, so that no commit lies on the latency path. One file per session; it can be
// replayed.
//
// append() only queues. The first failure (file not creatable, disk full, queue overrun) is kept:
// status() says so until the next begin(), nothing more is written to that file, and `on_error` is
// told once. What was committed before stays readable; the surgery file survives a crash at any
// instant.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "common/core/error.hpp"
#include "common/io/recording/surgery_file.hpp"

namespace brainshift::server {

using JournalMeta = io::SurgeryMeta;

// Where records go; a surgery file, or a stand-in that fails on purpose.
class RecordSink {
 public:
  virtual ~RecordSink() = default;
  virtual Status append(const io::SurgeryRecord& record) = 0;
  virtual Status close() = 0;
};
using OpenSink = std::function<Result<std::unique_ptr<RecordSink>>(
    const std::filesystem::path& path, const JournalMeta& meta)>;

// A new io::SurgeryFile.
Result<std::unique_ptr<RecordSink>> open_surgery_file(const std::filesystem::path& path,
                                                      const JournalMeta& meta);

// First free name "<case>-<session>.surgery", "<case>-<session>-2.surgery", ... in the folder;
// every character of the case id that is not a letter, digit, '-', '_' or '.' becomes '_'.
std::filesystem::path journal_path(const std::filesystem::path& folder, const std::string& case_id,
                                   const std::string& session);

class Journal {
 public:
  struct Options {
    std::function<void(const Error&)> on_error;  // on the journal's thread; may be empty
    OpenSink open = open_surgery_file;
    std::size_t max_queued = 4096;  // records
    std::size_t max_queued_bytes = 256u << 20;
  };

  explicit Journal(Options options);
  ~Journal();  // stop()
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  // Closes the current file and opens the next one; returns at once.
  void begin(const std::filesystem::path& path, const JournalMeta& meta);
  // Queues a record; ignored before the first begin().
  void append(io::SurgeryRecord record);
  // The failure of the current file, if there is one.
  Status status() const;
  // Writes what is queued, closes the file, ends the thread; idempotent.
  void stop();

 private:
  struct Opening {
    std::filesystem::path path;
    JournalMeta meta;
    std::uint64_t generation = 0;
  };
  struct Item {
    std::optional<Opening> opening;
    io::SurgeryRecord record;
  };

  void work(const std::stop_token& stop);
  void write(Item item);
  void close_sink();
  void set_error(std::uint64_t generation, const Error& error);

  const Options options_;
  std::unique_ptr<RecordSink> sink_;      // journal thread only
  std::uint64_t writing_generation_ = 0;  // journal thread only

  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<Item> queue_;
  std::size_t queued_bytes_ = 0;
  std::uint64_t generation_ = 0;  // counts begin()
  std::optional<Error> error_;    // of the current generation

  std::jthread thread_;
};

}  // namespace brainshift::server
