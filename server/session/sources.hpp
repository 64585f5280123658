// SPDX-License-Identifier: GPL-3.0-or-later
// Which observations a session accepts, and of which sources: how far each has counted, and by what
// clock. What is refused leaves no trace: it takes no source's place and no number.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/error.hpp"
#include "common/values/observation.hpp"
#include "common/values/session.hpp"

namespace brainshift::server {

// What a daemon takes of one observation, so that no observation keeps it from the others for long:
// an alignment of so many points takes less than a second, and as many pairs as a surgeon touches.
inline constexpr int kMaxObservedPoints = 50'000;      // of a boundary or a surface
inline constexpr int kMinObservedPoints = 3;           // or pairs: fewer show no motion
inline constexpr int kMaxObservedTriangles = 100'000;  // of a surface
inline constexpr int kMaxLandmarkPairs = 1'000;

// Ok, or kInvalidArgument for another case, session, model or daemon than `running`, a frame other
// than "ras", an empty or overlong source, more or fewer points, triangles or pairs than an
// observation may have, or a body that no update uses (PatientPose). The sentence names the field
// and its value. The numbers of the body are not looked at: wire::decode_observation has tested
// that they are finite and that standard deviations are not negative.
Status check_observation(const Observation& observation, std::string_view case_id,
                         const SessionKey& running);

// The clock of one source against the daemon's, and which of its observations are plausible.
//
// Clocks of different machines share no zero. The offset between a source's clock and the daemon's
// is that of the fastest message of the session so far:
//   offset = min (arrival - hand-over)       hand-over: sent_ns, or acquired_ns where that is 0
// An observation is then acquired_ns + offset old on the daemon's clock, and its delay is never
// negative by more than what the fastest message took. Without sent_ns the first observation of a
// source counts as new: nothing tells how old it is.
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
  std::optional<std::int64_t> offset_ns_, refused_offset_ns_;
  std::int64_t last_acquired_ns_ = 0;
};

// As above for sessions whose sources share the recording's clock: only kMaxStamp_ns holds.
Result<std::int64_t> recorded_time(const Observation& observation);

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
  // client: the connection that it came by.
  // Errors: kInvalidArgument for a sequence number that is not above the source's last one (the
  // sentence tells the next), or above kMaxSequence; those of SourceClock; kUnavailable when
  // kMaxSourcesOfOne others have observed by this connection, or kMaxSources others within
  // max_age_s. Of those that were silent for longer the one that was so longest makes room: what it
  // has observed is used no more.
  // A source that comes by another connection with an earlier time than before has been started
  // again: its clock begins anew. Its numbers go on, since the journal names observations by them.
  Result<Admission> admit(const Observation& observation, std::int64_t arrived_ns,
                          bool replaces_pending, const std::string& client = {});

  static constexpr std::size_t kMaxSources = 16;
  static constexpr std::ptrdiff_t kMaxSourcesOfOne = 8;  // names that one peer may bring
  // The journal keeps sequence numbers as signed 64-bit integers.
  static constexpr std::uint64_t kMaxSequence = (std::uint64_t{1} << 63) - 1;

 private:
  struct Source {
    SourceClock clock;
    std::int64_t last_acquired_ns = 0;
    ObservationReceipt receipt;  // of its last observation
    std::string client;          // by which that came
    std::int64_t arrived_ns = 0;
  };
  using Map = std::map<std::string, Source>;  // by name

  // For one more source.
  Status has_room(const Observation& observation, std::int64_t arrived_ns,
                  const std::string& client) const;
  Map::const_iterator longest_silent() const;  // there is one

  double max_age_s_;
  bool recorded_clock_;
  Map sources_;
};

}  // namespace brainshift::server
