// SPDX-License-Identifier: Apache-2.0
// What a daemon and its clients tell each other beside observations and fields: the daemon's
// status, the request for a session and its answer, the receipt of an observation, an update or
// the error in its place. Times in the unit of the name; byte and node counts as they were
// received.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/values/session_state.hpp"

namespace brainshift {

struct DaemonStatus {
  std::string version;
  bool model_ready = false;
  std::string case_id;
  std::string model_id;
  bool busy = false;
  std::uint64_t updates = 0;
  std::uint64_t uptime_ms = 0;
  // On what updates are computed: bits are comparable only where all three agree.
  std::string build = {};
  std::string machine = {};
  std::string blas_kernel = {};
};

struct SessionRequest {
  std::string case_id;
  Method method = Method::kCondensed;
  Boundary boundary = Boundary::kContact;
  bool publish_iterates = false;
  // End the running session although another client that is still connected started it.
  bool takeover = false;
  // Ages by the observations' own clock, which all sources share (a replay); false: by arrival.
  bool recorded_clock = false;
};

struct SessionInfo {
  std::uint64_t session_id = 0;
  std::string model_id;
  int nodes = 0;
  int tets = 0;
  int slaves = 0;
  double prepare_s = 0.0;
  std::uint64_t model_bytes = 0;
  std::uint64_t boot_id = 0;  // of the daemon's process

  SessionKey key() const { return {boot_id, session_id, model_id}; }
};

struct ObservationReceipt {
  std::uint64_t observation_sequence = 0;
  bool replaced_pending = false;
};

// An update as a client sees it: either an estimate, or the reason why there is none.
struct UpdateMessage {
  std::uint64_t session_id = 0;
  Update update;
  std::optional<Error> error;  // set when the observation gave no estimate
  std::uint64_t boot_id = 0;   // of the daemon's process
  // How it came, in a message that a client hands out: bytes of its payload, nodes in it.
  std::size_t received_bytes = 0;
  int received_nodes = 0;
  std::chrono::nanoseconds received_at{0};  // when, on BootClock

  SessionKey key() const { return {boot_id, session_id, update.model_id}; }
};

}  // namespace brainshift
