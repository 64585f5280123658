// SPDX-License-Identifier: Apache-2.0
#include "client/lib/field_status.hpp"

namespace brainshift::client {

std::string_view to_string(Currency currency) {
  switch (currency) {
    case Currency::kNone: return "none";
    case Currency::kCurrent: return "current";
    case Currency::kSuperseded: return "superseded";
    case Currency::kDegraded: return "degraded";
    case Currency::kStale: return "stale";
  }
  return "unknown";
}

}  // namespace brainshift::client
