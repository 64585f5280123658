// SPDX-License-Identifier: Apache-2.0
// The time of day, UTC, as text: for metadata and file names, never for measuring.
#pragma once

#include <ctime>
#include <string>

namespace brainshift {

// Now, written by strftime; the default is ISO 8601 to the second ("2025-01-31T12:34:56Z").
inline std::string utc_now(const char* format = "%Y-%m-%dT%H:%M:%SZ") {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[64];
  return {text, std::strftime(text, sizeof text, format, &utc)};
}

}  // namespace brainshift
