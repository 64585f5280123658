// SPDX-License-Identifier: Apache-2.0
#include "common/values/decision.hpp"

#include "common/core/types.hpp"

namespace brainshift {

std::string_view to_string(Outcome outcome) {
  static constexpr std::string_view kNames[] = {"used", "failed", "superseded", "skipped"};
  return enum_name<Outcome::kSkipped>(outcome, kNames);
}

}  // namespace brainshift
