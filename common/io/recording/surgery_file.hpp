// SPDX-License-Identifier: GPL-3.0-or-later
// Surgery file: a recorded (or simulated) surgery, and the daemon's journal; one SQLite database.
//
// Tables (schema version 2, `PRAGMA user_version`):
//   meta(key, value)               the members of SurgeryMeta
//   record(id, kind, sequence, recorded_ns, payload, crc)   kind 'observation' | 'update' |
//                                  'decision'; id counts from 1; payload is an encoded wire
//                                  message, opaque here; crc: record_chain.hpp
//   seal(name, records, crc)       'meta': checksum of meta, from which the chain starts;
//                                  'closed': written by close(), the number of records and the end
//                                  of the chain
//   truth_field(observation_sequence, nodes, displacement, crc)  simulated surgeries only:
//                                  float64 3 x nodes, mm; crc over all truth of the observation
//   truth_point(observation_sequence, kind, node0..3, weight0..3)  where truth is scored: kind
//                                  'sparse' | 'cross' | 'craniotomy'; a point is
//                                  sum(weight_i * node_i)
//   truth_scalar(observation_sequence, name, value)
//
// Truth is read only by the code that scores.
// Synchronous FULL, WAL: an acknowledged record survives power loss. create() refuses to
// overwrite. `PRAGMA application_id` is 0x42534652 ("BSFR"). Sequences are below 2^63 (SQLite's
// integers are signed). Another process may read the file while it is written. One SurgeryFile
// belongs to one thread at a time. Destroying a file without close() keeps every record but may
// leave the -wal file beside it, which then holds a part of the records: SurgeryState::closed is
// false. A file on a disk that cannot be written is read as it is.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/io/recording/surgery_record.hpp"

namespace brainshift::io {

// What a file is when it is opened.
struct SurgeryState {
  // The file was closed, and nothing was added since: no record is missing at its end. False for a
  // file that is still written, and a crashed one.
  bool closed = false;
  bool log_beside = false;  // a -wal file with content
  std::uint64_t records = 0;
};
// "797 records, not closed: the end is missing if a -wal file was left behind"
std::string describe(const SurgeryState& state);

// Removes a surgery file that could not be completed, with what the database keeps beside it.
void discard_surgery(const std::filesystem::path& path);

class SurgeryFile {
 public:
  // A new file; kWriteFailed if it exists or cannot be made.
  static Result<SurgeryFile> create(const std::filesystem::path& path, const SurgeryMeta& meta);
  // An existing file, read-only; kNotFound, or kUnreadable if it is not a surgery file of this
  // version, lacks a part, or was closed with another number of records than it has.
  static Result<SurgeryFile> open(const std::filesystem::path& path);
  // As open, but what is missing at the end is no error here; visit() gives the valid prefix.
  static Result<SurgeryFile> open_damaged(const std::filesystem::path& path);
  // An existing file to add to, with the same promises as one that create() made. As open, and
  // every record is checked; kWriteFailed when it cannot be written. Truth that is there stays as
  // it is.
  static Result<SurgeryFile> open_to_append(const std::filesystem::path& path);
  SurgeryFile(SurgeryFile&&) noexcept;
  SurgeryFile& operator=(SurgeryFile&&) noexcept;
  ~SurgeryFile();

  // All of the records or none, with one sync.
  Status append(std::span<const SurgeryRecord> records);
  Status append(const SurgeryRecord& record);
  Status write_truth(std::uint64_t observation_sequence, const SurgeryTruth& truth);
  // Seals the file and folds the write-ahead log into it, so that it is one file on disk.
  // kWriteFailed, with nothing touched, when the file is not in place.
  Status close();
  // False when the file, or its write-ahead log, was deleted, moved or replaced since it was
  // opened: what is appended now is lost.
  bool in_place() const;

  const std::filesystem::path& path() const;
  const SurgeryMeta& meta() const;
  // As it was when opened; of a file that is written, as it is now.
  const SurgeryState& state() const;

  // Hands over every record in the order of the file, each one after its checksum has been
  // compared. Ends with the visitor's first error, or with kUnreadable at the first record that is
  // not what was written; what was handed over before is the valid prefix. A file that was closed
  // must end where it was closed.
  Status visit(const std::function<Status(const SurgeryRecord&)>& visitor) const;
  // The records of a kind, in order; an error when any record of the file is not what was written.
  Result<std::vector<SurgeryRecord>> records(RecordKind kind) const;
  // Hands over the records of a kind from the newest backwards for as long as the visitor says
  // true, each one after its checksum has been compared with the record before it. What lies
  // before the last one is not read: of a running journal, without its hours.
  Status newest_first(RecordKind kind,
                      const std::function<Result<bool>(const SurgeryRecord&)>& visitor) const;
  // kNotFound when the surgery carries no truth for that observation (a real recording).
  Result<SurgeryTruth> read_truth(std::uint64_t observation_sequence) const;

 private:
  struct Impl;
  explicit SurgeryFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::io
