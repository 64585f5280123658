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
  kAged,        // it is the newest usable one, but older than the daemon's first limit: show it so
  kExpired,     // it is older than the second limit: not to be shown
};

std::string_view to_string(Currency currency);  // "none", "current", ..., "expired"

struct FieldStatus {
  Currency currency = Currency::kNone;
  std::string reason;  // one sentence to show; empty when current
  double age_s = 0.0;  // since its data were acquired; NaN: not known
  // A recording is played (SessionState::recorded): display the word RECORDED with its field.
  bool recorded = false;
};

}  // namespace brainshift::client
