// SPDX-License-Identifier: GPL-3.0-or-later
// Journal: every accepted observation, every final update and every decision, written to a surgery
// file by a thread of its own, so that no commit lies on the latency path. One file per session,
// and one more after every failure; they can be replayed.
//
// A session in which nothing was observed leaves no file: it is removed when the next one begins,
// and at stop().
//
// append() only queues. The thread writes what came within `commit_interval` in one transaction
// with one sync. What recorded() then says is on the disk stays there through a crash and a power
// cut. An observation thus has two acknowledgements: *accepted* when it is queued, *recorded* when
// recorded() says that it is held.
//
// A failure (a file that cannot be made, a full disk, a failing sync, a file that was deleted or
// replaced, storage so slow that the queue is full) ends the file. status() and recorded() say why
// from then on, and `on_error` is told once. The records of the failed transaction are tried again
// in a new file at once; if that fails too, they are lost, and so is what is appended until a new
// file can be written, which is tried every `retry_interval`. The new file has the next free name,
// as has the first when another daemon took its name in the same moment.
// Its meta names the file before it and what neither of them holds.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "common/core/error.hpp"
#include "common/io/recording/surgery_record.hpp"
#include "server/journal/record_sink.hpp"

namespace brainshift::server {

struct SequenceRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  std::uint64_t count = 0;  // 0: empty; below last - first + 1 where numbers were left out

  void add(const SequenceRange& other);
  bool operator==(const SequenceRange&) const = default;
};

// Which observations and updates a set of records holds, as one range of sequences for each source
// and one for the updates. Decisions are about these and are not counted.
struct RecordRanges {
  std::map<std::string, SequenceRange> observations;  // by source
  SequenceRange updates;

  void add(io::RecordKind kind, const std::string& source, std::uint64_t sequence);
  void add(const RecordRanges& other);
  bool empty() const { return observations.empty() && updates.count == 0; }
};

// "observations 5 to 9 of ius (5), updates 3 to 7 (4)"; "nothing" when empty.
std::string describe(const RecordRanges& ranges);

// What is durable of the running session.
struct Recorded {
  std::uint64_t session_id = 0;  // as begin() was told; 0 before the first
  bool recording = false;        // what is appended now will be written
  std::string reason;            // why not; empty while recording
  std::filesystem::path file;    // that is written, or was last
  std::uint64_t records = 0;     // on the disk, in all files of the session
  RecordRanges held;             // what was committed and synced
  RecordRanges missing;          // what no file holds and none will
};

class Journal {
 public:
  struct Options {
    // All on the journal's thread; may be empty.
    std::function<void(const Error&)> on_error;
    std::function<void(const std::filesystem::path&)> on_resumed;  // recording goes on there
    // After every commit, and whenever recording begins, fails or goes on.
    std::function<void(const Recorded&)> on_recorded;
    OpenSink open = open_surgery_file;
    std::size_t max_queued = 4096;  // records
    std::size_t max_queued_bytes = 256u << 20;
    // Of the payloads of a session; beyond them recording ends, and says so.
    std::uint64_t max_session_bytes = std::uint64_t{64} << 30;
    std::chrono::milliseconds commit_interval{5};
    std::chrono::milliseconds check_interval{250};  // whether the file is still there
    std::chrono::milliseconds retry_interval{1000};
    // With less free space recording does not go on: it would fail again within moments.
    std::uintmax_t resume_free_bytes = 16u << 20;
  };

  explicit Journal(Options options);
  ~Journal();  // stop()
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  // A session begins: closes the current file and opens the next one; returns at once.
  void begin(const std::filesystem::path& path, const JournalMeta& meta,
             std::uint64_t session_id = 0);
  // Queues a record; never waits for the disk. Ignored before the first begin(). A recorded_ns of 0
  // becomes now. source: of an observation.
  void append(io::SurgeryRecord record, std::string source = {});
  // Why records are lost at the moment, if they are.
  Status status() const;
  Recorded recorded() const;
  // Writes what is queued, closes the file, ends the thread; idempotent.
  void stop();

 private:
  using Clock = std::chrono::steady_clock;

  enum class Phase {
    kIdle,       // before the first begin()
    kRecording,  // records are queued
    kFailed,     // records are lost
    kResuming,   // a new file is being opened: records are queued for it
  };
  struct Opening {
    std::filesystem::path path;
    JournalMeta meta;
    std::uint64_t generation = 0;
  };
  struct Item {
    std::optional<Opening> opening;
    io::SurgeryRecord record;
    std::string source;
  };
  // Records that are committed together.
  struct Group {
    std::vector<io::SurgeryRecord> records;
    std::vector<std::string> sources;
    RecordRanges ranges() const;
  };

  void work(const std::stop_token& stop);
  // Waits for records, a session, or the time of the next check. False at the end.
  bool take(const std::stop_token& stop, Group& group, std::optional<Opening>& opening);
  void interrupt(const Error& error, Group group, std::optional<Opening> opening);
  Result<std::unique_ptr<RecordSink>> open_file(std::filesystem::path& path,
                                                const JournalMeta& meta);
  void begin_file(const Opening& opening);
  void end_session();
  void write(Group group);
  Status commit(const Group& group);
  void supervise();
  void resume();
  void end_file(const Error& error, bool contents_lost);
  void close_sink();
  void lose(const RecordRanges& ranges);
  void tell_recorded();

  const Options options_;

  // Of the journal's thread.
  std::unique_ptr<RecordSink> sink_;
  Opening current_;               // the session being written
  std::filesystem::path path_;    // of sink_, or of the file before it; empty: none
  RecordRanges contents_;         // of that file
  Group unwritten_;               // of the transaction that failed
  Clock::time_point next_check_;  // of the file, or the next try to go on

  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<Item> queue_;
  std::size_t queued_bytes_ = 0;
  std::size_t openings_ = 0;      // in the queue
  std::uint64_t generation_ = 0;  // counts begin()
  Phase phase_ = Phase::kIdle;
  std::optional<Error> error_;       // of the current generation
  bool overrun_ = false;             // error_ is one that the thread has not seen yet
  bool exhausted_ = false;           // the session has max_session_bytes: nothing more is recorded
  std::uint64_t session_bytes_ = 0;  // of the payloads queued in it
  RecordRanges gap_;                 // lost since the last file
  Recorded recorded_;

  std::jthread thread_;
};

}  // namespace brainshift::server
