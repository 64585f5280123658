// SPDX-License-Identifier: Apache-2.0
#include "common/core/error.hpp"

#include "common/core/types.hpp"

namespace brainshift {

std::string_view to_string(ErrorCode code) {
  static constexpr std::string_view kNames[] = {
      "invalid_argument", "not_found",     "unreadable",      "write_failed", "degenerate_mesh",
      "empty_set",        "floating_body", "singular_matrix", "not_finite",   "not_converged",
      "model_not_ready",  "protocol",      "unavailable",     "not_allowed",  "internal"};
  return enum_name<ErrorCode::kInternal>(code, kNames);
}

}  // namespace brainshift
