// SPDX-License-Identifier: Apache-2.0
#include "common/values/session_state.hpp"

#include <algorithm>

namespace brainshift {

std::string_view to_string(SessionPhase phase) {
  switch (phase) {
    case SessionPhase::kEmpty: return "empty";
    case SessionPhase::kPreparing: return "preparing";
    case SessionPhase::kReady: return "ready";
    case SessionPhase::kTracking: return "tracking";
    case SessionPhase::kDegraded: return "degraded";
    case SessionPhase::kClosed: return "closed";
  }
  return "unknown";
}

bool RecordingState::holds(std::string_view source, std::uint64_t sequence) const {
  return std::any_of(sources.begin(), sources.end(), [&](const RecordedSource& recorded) {
    return recorded.source == source && sequence > recorded.lost_until &&
           sequence <= recorded.until;
  });
}

}  // namespace brainshift
