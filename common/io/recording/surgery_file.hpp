// SPDX-License-Identifier: GPL-3.0-or-later
// Surgery file: a recorded (or simulated) surgery, and the daemon's journal; one SQLite database.
//
// Tables (schema version 1, `PRAGMA user_version`):
//   meta(key, value)               the members of SurgeryMeta
//   record(id, kind, sequence, recorded_ns, payload)   kind 'observation' | 'update'; payload is an
//                                  encoded wire message, opaque here
//   truth_field(observation_sequence, nodes, displacement)  simulated surgeries only:
//                                  float64 3 x nodes, mm
//   truth_point(observation_sequence, kind, node0..3, weight0..3)  where truth is scored: kind
//                                  'sparse' | 'cross' | 'craniotomy'; a point is
//                                  sum(weight_i * node_i)
//   truth_scalar(observation_sequence, name, value)
// Truth is read only by the code that scores.
// Synchronous FULL, WAL: an acknowledged record survives power loss. create() refuses to
// overwrite. `PRAGMA application_id` is 0x42534652 ("BSFR"). Sequences are below 2^63 (SQLite's
// integers are signed). Another process may read the file while it is written. One SurgeryFile
// belongs to one thread at a time. Destroying a file without close() keeps every record but may
// leave the -wal file beside it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

// What the meta table says. Empty texts are not written; keys that are not listed here are not
// read.
struct SurgeryMeta {
  std::string case_id = {};
  std::string model_id = {};
  std::string case_file = {};
  std::string scenario = {};  // "recorded" for a journal
  std::optional<std::uint64_t> seed = {};
  std::string method = {};  // of a journal's session, as is the boundary
  std::string boundary = {};
  std::string created_utc = {};
  std::string software = {};

  bool operator==(const SurgeryMeta&) const = default;
};

enum class RecordKind { kObservation, kUpdate };
std::string_view to_string(RecordKind kind);  // "observation", "update", as in the file

struct SurgeryRecord {
  RecordKind kind = RecordKind::kObservation;
  std::uint64_t sequence = 0;
  std::int64_t recorded_ns = 0;  // monotonic clock of the recording
  std::string payload;
};

// A point of the undeformed mesh where truth and estimate are compared.
struct ScorePoint {
  Eigen::Vector4i nodes = Eigen::Vector4i::Zero();
  Eigen::Vector4d weights = Eigen::Vector4d(1, 0, 0, 0);  // barycentric, sum 1
};

struct SurgeryTruth {
  Points displacement;                                    // 3 x n, mm, every node
  std::map<std::string, std::vector<ScorePoint>> points;  // by kind
  std::map<std::string, double> scalars;                  // e.g. "fluid_level_mm"
};

// Removes a surgery file that could not be completed, with what the database keeps beside it.
void discard_surgery(const std::filesystem::path& path);

class SurgeryFile {
 public:
  // A new file; kWriteFailed if it exists or cannot be made.
  static Result<SurgeryFile> create(const std::filesystem::path& path, const SurgeryMeta& meta);
  // An existing file, read-only; kNotFound, or kUnreadable if it is not a surgery file of this
  // version.
  static Result<SurgeryFile> open(const std::filesystem::path& path);
  // An existing file to add to, with the same promises as one that create() made. As open;
  // kWriteFailed when it cannot be written. Truth that is there stays as it is.
  static Result<SurgeryFile> open_to_append(const std::filesystem::path& path);
  SurgeryFile(SurgeryFile&&) noexcept;
  SurgeryFile& operator=(SurgeryFile&&) noexcept;
  ~SurgeryFile();

  Status append(const SurgeryRecord& record);
  Status write_truth(std::uint64_t observation_sequence, const SurgeryTruth& truth);
  // Folds the write-ahead log into the file, so that it is one file on disk.
  Status close();

  const SurgeryMeta& meta() const;
  Result<std::vector<SurgeryRecord>> records(RecordKind kind) const;  // by id
  // kNotFound when the surgery carries no truth for that observation (a real recording).
  Result<SurgeryTruth> read_truth(std::uint64_t observation_sequence) const;

 private:
  struct Impl;
  explicit SurgeryFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::io
