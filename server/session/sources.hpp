// SPDX-License-Identifier: GPL-3.0-or-later
// The sources of one session: how far each has counted, and by what clock. What is refused leaves
// no trace: it takes no source's place and no number.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include "common/core/error.hpp"
#include "common/values/observation.hpp"
#include "common/values/session.hpp"
#include "server/session/source_clock.hpp"

namespace brainshift::server {

struct Admission {
  ObservationReceipt receipt;
  std::int64_t daemon_ns = 0;  // acquired_ns on the clock that all sources of the session share
  bool repeated = false;       // the source's last observation once more: nothing is to be done
};

class Sources {
 public:
  // max_age_s: sensing.max_age_s. recorded_clock: the sources share the recording's clock.
  Sources(double max_age_s, bool recorded_clock)
      : max_age_s_(max_age_s), recorded_clock_(recorded_clock) {}

  // arrived_ns: on the daemon's monotonic clock. replaces_pending: what the receipt says of it.
  // Errors: kInvalidArgument for a sequence number that is not above the source's last one, or
  // above kMaxSequence; those of SourceClock; kUnavailable when kMaxSources others have observed.
  Result<Admission> admit(const Observation& observation, std::int64_t arrived_ns,
                          bool replaces_pending);

  static constexpr std::size_t kMaxSources = 16;
  // The journal keeps sequence numbers as signed 64-bit integers.
  static constexpr std::uint64_t kMaxSequence = (std::uint64_t{1} << 63) - 1;

 private:
  struct Source {
    SourceClock clock;
    std::int64_t last_acquired_ns = 0;
    ObservationReceipt receipt;  // of its last observation
  };

  double max_age_s_;
  bool recorded_clock_;
  std::map<std::string, Source> sources_;  // by name
};

}  // namespace brainshift::server
