// SPDX-License-Identifier: Apache-2.0
// Text of strangers (peers, files, arguments): it travels as UTF-8, and is shown on one line that
// drives no terminal. And the time of day as text: for metadata and file names, never for
// measuring.
#pragma once

#include <ctime>
#include <string>
#include <string_view>

namespace brainshift {

// Whether `text` is well-formed UTF-8 (Unicode 15, table 3-7).
bool is_utf8(std::string_view text);

// `text` with '?' for every byte that is not part of well-formed UTF-8.
// File names are bytes on POSIX, so an error that quotes one may hold any byte.
std::string to_utf8(std::string_view text);

// `text` with `instead` for every character that moves the cursor, changes the terminal or turns
// the direction of writing (C0 and C1 controls, DEL, U+061C, U+200B to U+200F, U+2028 to U+202E,
// U+2060 to U+206F, U+FEFF), and for every byte that is not UTF-8: whoever prints it prints one
// line that reads as it is written.
std::string one_line(std::string_view text, char instead = ' ');

// one_line with '?', between double quotes; of a longer text the first 64 characters and "...".
std::string in_quotes(std::string_view text);

// Now, UTC, written by strftime; the default is ISO 8601 to the second ("2025-01-31T12:34:56Z").
inline std::string utc_now(const char* format = "%Y-%m-%dT%H:%M:%SZ") {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[64];
  return {text, std::strftime(text, sizeof text, format, &utc)};
}

}  // namespace brainshift
