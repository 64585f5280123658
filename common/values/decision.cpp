// SPDX-License-Identifier: Apache-2.0
#include "common/values/decision.hpp"

namespace brainshift {

std::string_view to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::kUsed: return "used";
    case Outcome::kFailed: return "failed";
    case Outcome::kSuperseded: return "superseded";
    case Outcome::kSkipped: return "skipped";
  }
  return "";
}

}  // namespace brainshift
