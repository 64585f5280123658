// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/source_clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "server/session/observation_rules.hpp"

namespace brainshift::server {
namespace {

double seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

Status check_stamp(const char* name, std::int64_t stamp_ns) {
  if (stamp_ns >= -SourceClock::kMaxStamp_ns && stamp_ns <= SourceClock::kMaxStamp_ns) return {};
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("observation.{} = {}: no monotonic clock shows this, must be within {}",
                          name, stamp_ns, SourceClock::kMaxStamp_ns));
}

tl::unexpected<Error> refuse(const Observation& observation, const std::string& why) {
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("observation.acquired_ns = {} of {}: {}", observation.acquired_ns,
                          in_quotes(observation.source), why));
}

}  // namespace

Result<std::int64_t> recorded_time(const Observation& observation) {
  if (auto status = check_stamp("acquired_ns", observation.acquired_ns); !status) {
    return tl::unexpected(status.error());
  }
  return observation.acquired_ns;
}

Result<std::int64_t> SourceClock::to_daemon(const Observation& observation,
                                            std::int64_t arrived_ns) {
  const std::int64_t acquired_ns = observation.acquired_ns;
  if (auto status = check_stamp("acquired_ns", acquired_ns); !status) {
    return tl::unexpected(status.error());
  }
  if (auto status = check_stamp("sent_ns", observation.sent_ns); !status) {
    return tl::unexpected(status.error());
  }
  const std::int64_t sent_ns = observation.sent_ns != 0 ? observation.sent_ns : acquired_ns;
  if (acquired_ns > sent_ns) {
    return refuse(observation, fmt::format("acquired {:.3g} s after it was sent",
                                           seconds(acquired_ns - sent_ns)));
  }
  if (offset_ns_ && acquired_ns < last_acquired_ns_) {
    return refuse(observation, fmt::format("acquired {:.3g} s before the one before it",
                                           seconds(last_acquired_ns_ - acquired_ns)));
  }
  const std::int64_t offset_ns = arrived_ns - sent_ns;
  if (offset_ns_ && *offset_ns_ - offset_ns > kMaxJump_ns) {
    const bool again =
        refused_offset_ns_ && std::abs(*refused_offset_ns_ - offset_ns) <= kMaxJump_ns;
    const std::int64_t jump_ns = *offset_ns_ - offset_ns;
    refused_offset_ns_ = offset_ns;
    if (!again) {
      return refuse(observation, fmt::format("the source's clock has jumped ahead by {:.0f} s",
                                             seconds(jump_ns)));
    }
  }
  const std::int64_t known_ns = offset_ns_ ? std::min(*offset_ns_, offset_ns) : offset_ns;
  const double age_s = seconds(arrived_ns - (acquired_ns + known_ns));
  if (age_s > max_age_s_) {
    return refuse(observation, fmt::format("{:.0f} s old when it arrived, sensing.max_age_s = {:g}",
                                           age_s, max_age_s_));
  }
  offset_ns_ = known_ns;
  refused_offset_ns_.reset();
  last_acquired_ns_ = acquired_ns;
  return acquired_ns + known_ns;
}

}  // namespace brainshift::server
