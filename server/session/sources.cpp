// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/sources.hpp"

#include <fmt/format.h>

#include "server/session/observation_rules.hpp"

namespace brainshift::server {

Result<Admission> Sources::admit(const Observation& observation, std::int64_t arrived_ns,
                                 bool replaces_pending) {
  const auto known = sources_.find(observation.source);
  const bool is_new = known == sources_.end();
  if (is_new && sources_.size() >= kMaxSources) {
    return fail(ErrorCode::kUnavailable,
                fmt::format("observation.source = {}: {} other sources have observed already",
                            in_quotes(observation.source), sources_.size()));
  }
  Source source = is_new ? Source{SourceClock(max_age_s_), 0, {}} : known->second;
  const std::uint64_t last_sequence = source.receipt.observation_sequence;  // 0: none
  if (!is_new && observation.sequence == last_sequence &&
      observation.acquired_ns == source.last_acquired_ns) {
    return Admission{source.receipt, 0, true};
  }
  if (observation.sequence > kMaxSequence) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("observation.sequence = {}: must be at most {}", observation.sequence,
                            kMaxSequence));
  }
  if (observation.sequence <= last_sequence) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("observation.sequence = {}: must be above {}, the last one accepted "
                            "from {}",
                            observation.sequence, last_sequence, in_quotes(observation.source)));
  }
  const auto daemon_ns = recorded_clock_ ? recorded_time(observation)
                                         : source.clock.to_daemon(observation, arrived_ns);
  if (!daemon_ns) {
    if (!is_new) known->second.clock = source.clock;  // it remembers a jump that it refused
    return tl::unexpected(daemon_ns.error());
  }
  source.last_acquired_ns = observation.acquired_ns;
  source.receipt = {observation.sequence, replaces_pending};
  const Admission admission{source.receipt, *daemon_ns, false};
  sources_.insert_or_assign(observation.source, source);
  return admission;
}

}  // namespace brainshift::server
