// SPDX-License-Identifier: GPL-3.0-or-later
// Plays recorded observations to a daemon session and collects what comes back.
//
// Latency is taken on the client's monotonic clock, from just before the observation is sent until its
// final update has been received and decoded. Iterates are kept for the latest answered observation only.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/estimate.hpp"
#include "common/core/observation.hpp"
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
};

struct Iterate {
  int iteration = 0;
  Points displacement;
};

// Exactly one of latency_ms, error, superseded describes the outcome.
struct PlayedObservation {
  std::uint64_t sequence = 0;
  std::optional<double> latency_ms;
  std::optional<double> first_iterate_ms;
  StageTimings timings;
  std::optional<Error> error;
  bool superseded = false;  // the daemon dropped it for a newer one before it had started
};

struct PlayedSession {
  std::vector<PlayedObservation> observations;  // one per recorded observation, in order
  std::optional<Update> last;                   // the last final update that carries an estimate
  std::vector<Iterate> iterates;                // of the observation that `last` answers
};

// Never fails as a whole: what went wrong stands with its observation. After kUnavailable the remaining
// observations are not sent and carry the same error.
PlayedSession play(const DaemonLink& link, const std::vector<RecordedObservation>& recording,
                   const PlayOptions& options, const Progress& progress = {});

}  // namespace brainshift::client
