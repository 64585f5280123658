// SPDX-License-Identifier: GPL-3.0-or-later
// Plays recorded observations to a daemon session and collects the answers.
//
// Latency is taken on the client's monotonic clock, from just before an observation is sent until
// its final update has been received and decoded. Fields and iterates are kept for the latest
// observation with a usable answer only: the others leave some hundred bytes each, however large
// the mesh.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/geometry/tumour_motion.hpp"
#include "common/io/recording/surgery_record.hpp"
#include "common/values/estimate.hpp"
#include "common/values/observation.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

class Client;

// What play() needs of a daemon: Client's calls of the same names, or a test's own.
struct DaemonLink {
  std::function<Result<ObservationReceipt>(const Observation&)> submit;
  // Blocks up to the timeout; kUnavailable when it has passed.
  std::function<Result<UpdateMessage>(std::chrono::milliseconds)> next_update;
  // Whether the session that is played to still runs: Client::session_status().
  std::function<Status()> session_status = [] { return Status{}; };
};
// Keeps a reference to the client.
DaemonLink link_to(Client& client);

struct RecordedObservation {
  std::int64_t recorded_ns = 0;  // monotonic clock of the recording
  Observation observation;
};

// A recorded observation as it is sent to another session: without its own session, and acquired by
// the clock of the daemon that journalled it, where one did (SessionRequest::recorded_clock).
Observation for_replay(Observation recorded);

enum class Speed {
  kMax,       // next observation as soon as the former is answered
  kRecorded,  // at the recorded times, relative to the first
};

struct PlayOptions {
  // Updates of other sessions are ignored, e.g. the one that a late joiner gets.
  std::uint64_t session_id = 0;
  Speed speed = Speed::kMax;
  std::chrono::milliseconds timeout{120000};  // longest wait for one answer
  // The recording is played this many times, at least 1; more than 1 at Speed::kMax only. Sequence
  // numbers count up from cycle to cycle, else the daemon would reject them.
  int repeat = 1;
  std::vector<NodeIndex> tumour = {};  // whose motion every answer is asked for
};

struct Iterate {
  int iteration = 0;
  Points displacement;
};

// One observation as it was sent. Exactly one of latency_ms, error and superseded tells how it
// ended; the other values belong to latency_ms.
struct PlayedObservation {
  std::uint64_t sequence = 0;  // as sent
  std::optional<double> latency_ms;
  std::optional<double> first_iterate_ms;
  StageTimings timings;
  EstimateStatus status = EstimateStatus::kNotRun;
  QualityVerdict quality;
  int active = 0;                                // slaves that carry a contact force
  int contact_iterations = 0;                    // active-set changes
  std::optional<geometry::TumourMotion> tumour;  // of a usable answer
  double misfit_mm = 0.0;                        // mean over the data
  std::optional<Error> error;
  bool superseded = false;  // the daemon dropped it for a newer one before it had started
};

struct PlayedSession {
  // In the order sent: `repeat` times the recording.
  std::vector<PlayedObservation> observations;
  std::optional<Update> last;                // the last usable update (Update::usable)
  std::uint64_t last_recorded_sequence = 0;  // of the recorded observation that `last` answers
  std::vector<Iterate> iterates;             // of the observation that `last` answers
  std::optional<Error> lost;                 // the daemon, or its session: why it ended early
};

// Never fails as a whole: each observation carries its own error. After kUnavailable, or when the
// session has ended, the remaining observations are not sent and carry the same error.
PlayedSession play(const DaemonLink& link, const std::vector<RecordedObservation>& recording,
                   const PlayOptions& options, const Progress& progress = {});

// Where a surgery that was interrupted goes on: after the last observation that its journal holds.
//
// A session that starts after a crash knows no observation. What an estimate depends on is the
// newest observation of every source (common/pipeline/evidence.hpp), so the last recorded one of
// each source is sent again, and then all that came after it.
struct ResumePoint {
  io::SurgeryMeta meta;
  std::uint64_t records = 0;                // in the valid prefix
  std::map<std::string, Observation> last;  // by source: its last observation
  std::uint64_t last_update = 0;            // its sequence; 0: none
  std::optional<Error> broken;              // what ended the valid prefix
};

// From the valid prefix of a journal, closed or not. kNotFound or kUnreadable when nothing of it
// can be read.
Result<ResumePoint> read_resume_point(const std::filesystem::path& journal);

// What is left to send of a recording, in its order. kInvalidArgument when the last observation of
// one of its sources is not in the recording: the journal is of another surgery.
Result<std::vector<RecordedObservation>> remaining(
    const std::vector<RecordedObservation>& recording, const ResumePoint& point);

// "goes on after observation 12 of ius and 3 of camera, update 14"
std::string describe(const ResumePoint& point);

}  // namespace brainshift::client
