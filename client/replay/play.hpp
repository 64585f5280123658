// SPDX-License-Identifier: GPL-3.0-or-later
// Plays recorded observations to a daemon session and collects what comes back.
//
// Latency is taken on the client's monotonic clock, from just before the observation is sent until its
// final update has been received and decoded. Fields and iterates are kept for the latest answered observation
// only: an observation that was played leaves some hundred bytes behind, however large the mesh.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/values/observation.hpp"
#include "common/core/progress.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

// What playing needs of a daemon: Client's calls of the same names, or a test's own.
struct DaemonLink {
  std::function<Result<wire::ObservationReceipt>(const Observation&)> submit;
  // Blocks up to the timeout; kUnavailable when it passed.
  std::function<Result<wire::UpdateMessage>(std::chrono::milliseconds)> next_update;
};

struct RecordedObservation {
  std::int64_t recorded_ns = 0;  // monotonic clock of the recording
  Observation observation;
};

enum class Speed {
  kMax,       // next observation as soon as the former is answered
  kRecorded,  // at the recorded times, relative to the first
};

struct PlayOptions {
  std::uint64_t session_id =
      0;  // updates of other sessions (a snapshot for late joiners) are ignored
  Speed speed = Speed::kMax;
  std::chrono::milliseconds timeout{120000};  // longest wait for one answer
  // The recording is played so many times over, at least 1; above 1 at Speed::kMax only. Sequence numbers go
  // on counting up from cycle to cycle (see sequence_in_cycle), else the daemon would refuse them.
  int repeat = 1;
};

struct Iterate {
  int iteration = 0;
  Points displacement;
};

// Exactly one of latency_ms, error, superseded describes the outcome; the rest goes with latency_ms.
struct PlayedObservation {
  std::uint64_t sequence = 0;  // as sent
  std::optional<double> latency_ms;
  std::optional<double> first_iterate_ms;
  StageTimings timings;
  EstimateStatus status = EstimateStatus::kNotRun;
  int active = 0;              // slaves that carry a contact force
  int contact_iterations = 0;  // active-set changes
  std::optional<Error> error;
  bool superseded = false;  // the daemon dropped it for a newer one before it had started
};

struct PlayedSession {
  std::vector<PlayedObservation>
      observations;                          // repeat times one per recorded observation, in order
  std::optional<Update> last;                // the last final update that carries an estimate
  std::uint64_t last_recorded_sequence = 0;  // of the recorded observation that `last` answers
  std::vector<Iterate> iterates;             // of the observation that `last` answers
};

// Sequence number that a recorded observation is sent with in a cycle (from 0): moved up by the span of the
// recorded numbers, last - first + 1, per cycle; as recorded in the first. Increasing numbers stay increasing.
std::uint64_t sequence_in_cycle(const std::vector<RecordedObservation>& recording,
                                std::size_t index, int cycle);

// Never fails as a whole: what went wrong stands with its observation. After kUnavailable the remaining
// observations are not sent and carry the same error.
PlayedSession play(const DaemonLink& link, const std::vector<RecordedObservation>& recording,
                   const PlayOptions& options, const Progress& progress = {});

}  // namespace brainshift::client
