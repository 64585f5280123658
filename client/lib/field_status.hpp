// SPDX-License-Identifier: Apache-2.0
// Whether the field that a viewer shows may be shown as current.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace brainshift::client {

enum class Currency {
  kNone,        // there is no usable field of the running session
  kCurrent,     // it is the newest usable one, and every observation since is answered by it
  kSuperseded,  // a newer usable one is on its way
  kDegraded,    // it is the newest usable one, but a newer observation gave none
  kStale,       // nothing is known of the daemon any more: it may be older than it looks
};

std::string_view to_string(Currency currency);  // "none", "current", ..., "stale"

struct FieldStatus {
  Currency currency = Currency::kNone;
  std::string reason;  // one sentence to show; empty when current
  double age_s = 0.0;  // since the observation that it answers reached the daemon; NaN: not known
};

}  // namespace brainshift::client
