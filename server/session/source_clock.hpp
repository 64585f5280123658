// SPDX-License-Identifier: GPL-3.0-or-later
// The clock of one source against the daemon's, and which of its observations are plausible.
//
// Clocks of different machines share no zero. The offset between a source's clock and the daemon's
// is that of the fastest message of the session so far:
//   offset = min (arrival - hand-over)       hand-over: sent_ns, or acquired_ns where that is 0
// An observation is then acquired_ns + offset old on the daemon's clock, and its delay is never
// negative by more than what the fastest message took. Without sent_ns the first observation of a
// source counts as new: nothing tells how old it is.
#pragma once

#include <cstdint>
#include <optional>

#include "common/core/error.hpp"
#include "common/values/observation.hpp"

namespace brainshift::server {

class SourceClock {
 public:
  // max_age_s: sensing.max_age_s, beyond which an observation is not used.
  explicit SourceClock(double max_age_s) : max_age_s_(max_age_s) {}

  // When the observation was acquired, on the daemon's clock, ns. arrived_ns: on the same clock.
  // kInvalidArgument, with the figure, and nothing is learnt:
  //   - a stamp beyond kMaxStamp_ns
  //   - acquired after it was sent, or before the source's last one
  //   - older than max_age_s when it arrived
  //   - ahead of the offset so far by more than kMaxJump_ns, unless the one refused before it says
  //     the same: a single wrong stamp changes nothing, a source that has set its clock is followed
  Result<std::int64_t> to_daemon(const Observation& observation, std::int64_t arrived_ns);

  static constexpr std::int64_t kMaxStamp_ns = std::int64_t{1} << 60;  // 36 years
  static constexpr std::int64_t kMaxJump_ns = 60'000'000'000;

 private:
  double max_age_s_;
  std::optional<std::int64_t> offset_ns_;
  std::optional<std::int64_t> refused_offset_ns_;
  std::int64_t last_acquired_ns_ = 0;
};

// As above for sessions whose sources share the recording's clock: only kMaxStamp_ns holds.
Result<std::int64_t> recorded_time(const Observation& observation);

}  // namespace brainshift::server
