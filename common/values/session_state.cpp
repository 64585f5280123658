// SPDX-License-Identifier: Apache-2.0
#include "common/values/session_state.hpp"

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

}  // namespace brainshift
