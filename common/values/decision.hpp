// SPDX-License-Identifier: Apache-2.0
// Decision: what became of an observation that the daemon accepted. The journal keeps one for
// each, so that a replay can send what was used, in the order in which it was used.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace brainshift {

enum class Outcome {
  kUsed,        // it was estimated from; an update with an estimate answers it
  kFailed,      // it was tried; an update with an error answers it
  kSuperseded,  // a newer one of its source came before it was begun
  kSkipped,     // its session ended first
};
std::string_view to_string(Outcome outcome);  // "used", "failed", "superseded", "skipped"

struct Decision {
  std::uint64_t session_id = 0;
  std::string source;
  std::uint64_t observation_sequence = 0;
  Outcome outcome = Outcome::kUsed;
  std::uint64_t update_sequence = 0;  // of the answer; 0: none
  int active = 0;                     // slaves with a contact force in the answer
  std::string reason;                 // one sentence; empty when it was used

  bool operator==(const Decision&) const = default;
};

}  // namespace brainshift
