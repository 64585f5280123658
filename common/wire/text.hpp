// SPDX-License-Identifier: Apache-2.0
// Text that travels: a proto3 string must be UTF-8, and an error sentence must stay on one line.
// Private to common/wire.
#pragma once

#include <string>
#include <string_view>

namespace brainshift::wire {

// Whether `text` is well-formed UTF-8 (Unicode 15, table 3-7).
bool is_utf8(std::string_view text);

// `text` with '?' for every byte that is not part of well-formed UTF-8.
// File names are bytes on POSIX, so an error that quotes one may hold any byte.
std::string to_utf8(std::string_view text);

// `text` with spaces for control characters, so that a peer's message cannot drive a terminal.
std::string one_line(std::string_view text);

// one_line between double quotes.
std::string in_quotes(std::string_view text);

}  // namespace brainshift::wire
