// SPDX-License-Identifier: Apache-2.0
// DaemonReport: how the daemon fares, for people and monitors (docs/operations.md). A daemon makes
// it when it is asked; nothing in it decides what a viewer may show.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/values/session_state.hpp"

namespace brainshift::wire {

// Percentiles of a time. Of no update at all: zeros.
struct LatencyFigures {
  std::uint64_t count = 0;
  double p50_ms = 0.0;
  double p95_ms = 0.0;
  double p99_ms = 0.0;
  double max_ms = 0.0;

  bool operator==(const LatencyFigures&) const = default;
};

// One part of the way of an update, from the arrival of its observation to its publication.
struct StageLatency {
  std::string stage;      // "wait", "register", ..., "total"
  LatencyFigures recent;  // of the last DaemonReport::recent_updates; exact
  LatencyFigures all;     // since the start; percentiles to 1 %
  double sum_ms = 0.0;    // of all
  // Of all, above the bound before it and up to DaemonReport::bounds_ms; one more has no bound.
  std::vector<std::uint64_t> bucket_counts;

  bool operator==(const StageLatency&) const = default;
};

// What became of a source's observations since the daemon started.
struct SourceCounts {
  std::string source;          // empty: not known, or beyond those that are counted by name
  std::uint64_t received = 0;  // messages; the sum of all below
  std::uint64_t answered = 0;  // an update with an estimate, the unusable ones too
  std::uint64_t failed = 0;    // an update with an error
  std::uint64_t replaced = 0;  // a newer one came before it was begun
  std::uint64_t skipped = 0;   // its session ended first
  std::uint64_t refused = 0;   // an ErrorReply
  std::uint64_t repeated = 0;  // the source's last one once more
  std::uint64_t waiting = 0;   // accepted, and none of these yet
  double age_ms = 0.0;         // since the last one arrived

  bool operator==(const SourceCounts&) const = default;
};

struct ViewerFigures {
  std::string peer;  // routing id, hexadecimal
  std::uint32_t window = 1;
  std::uint64_t sent = 0;      // updates in this subscription
  std::uint64_t received = 0;  // of these, by its own word
  std::uint32_t owed = 0;      // updates that wait for its credit
  std::uint32_t replies_waiting = 0;

  bool operator==(const ViewerFigures&) const = default;
};

struct JournalFigures {
  bool recording = false;
  std::string reason;  // why not; one sentence, else empty
  std::string file;    // that is written, or was last
  std::uint64_t bytes = 0;
  std::uint64_t records = 0;  // of the session, on the disk
  std::uint64_t lost = 0;     // observations and updates of the session that no file holds

  bool operator==(const JournalFigures&) const = default;
};

struct ProcessFigures {
  std::uint64_t resident_bytes = 0;
  std::uint64_t peak_bytes = 0;
  std::uint64_t descriptors = 0;
  std::uint64_t descriptor_limit = 0;
  std::uint64_t threads = 0;

  bool operator==(const ProcessFigures&) const = default;
};

// What the daemon's door let in and turned away since the start.
struct DoorFigures {
  std::uint64_t accepted = 0;              // connections
  std::uint64_t closed_for_breach = 0;     // no ZMTP, too large, too many parts, a routing id twice
  std::uint64_t closed_for_memory = 0;     // peers held too much of the daemon's memory
  std::uint64_t closed_for_silence = 0;    // nothing of the peer could be delivered
  std::uint64_t closed_for_room = 0;       // never served, when the last place was needed
  std::uint64_t held_bytes = 0;            // of messages under way, now
  std::uint64_t unknown_keys = 0;          // handshakes
  std::uint64_t refused_role = 0;          // requests beyond the role of their key
  std::uint64_t refused_connections = 0;   // beyond those that one key may have
  std::uint64_t refused_observations = 0;  // beyond those that a caller may send a second
  std::uint64_t refused_starts = 0;        // session starts beyond those of a minute

  bool operator==(const DoorFigures&) const = default;
};

struct DaemonReport {
  std::string version;
  std::string build;
  std::string machine;
  std::string blas_kernel;
  std::uint64_t uptime_ms = 0;
  bool model_ready = false;
  std::string case_id;
  SessionState session;
  std::string owner;        // of the session: routing id, hexadecimal; empty: nobody
  double max_age_s = 0.0;   // older data are not used; 0: no session
  double working_ms = 0.0;  // since the worker began what it does now; 0: it waits
  double limit_ms = 0.0;    // above this the worker hangs
  std::uint64_t usable = 0;
  std::uint64_t unusable = 0;
  std::uint64_t late = 0;  // of both: AnswerTime::late
  std::uint64_t failures = 0;
  std::uint64_t iterates = 0;
  std::vector<SourceCounts> sources = {};
  std::uint32_t clients = 0;
  std::vector<ViewerFigures> viewers = {};
  std::uint32_t recent_updates = 0;
  std::vector<double> bounds_ms = {};  // growing
  std::vector<StageLatency> stages = {};
  std::optional<JournalFigures> journal = {};  // empty: the daemon keeps none
  std::uint64_t log_lines_lost = 0;
  ProcessFigures process = {};
  DoorFigures door = {};

  // The worker is busy for longer than its work may take.
  bool worker_hangs() const { return working_ms > limit_ms; }
  bool operator==(const DaemonReport&) const = default;
};

std::string encode(const DaemonReport& report);
// kProtocol: malformed, or buckets that do not fit their bounds; kNotFinite.
Result<DaemonReport> decode_report(std::string_view payload);

}  // namespace brainshift::wire
