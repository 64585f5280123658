// SPDX-License-Identifier: GPL-3.0-or-later
// What a surgery file holds (surgery_file.hpp), as values.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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
  // Of a journal: on what the updates were computed. Bits are comparable only where these agree.
  std::string build = {};
  std::string machine = {};
  std::string blas_kernel = {};
  // Of a journal that goes on after a failure: the file before it, and what neither of them holds.
  std::string continues = {};
  std::string gap = {};

  bool operator==(const SurgeryMeta&) const = default;
};

enum class RecordKind { kObservation, kUpdate, kDecision };
// "observation", ..., as in the file
constexpr std::string_view to_string(RecordKind kind) {
  switch (kind) {
    case RecordKind::kObservation: return "observation";
    case RecordKind::kUpdate: return "update";
    case RecordKind::kDecision: return "decision";
  }
  return "";
}

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

}  // namespace brainshift::io
