// SPDX-License-Identifier: GPL-3.0-or-later
// Lines and cells of the small files that people write by hand.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::io {

// Without blanks at either end.
std::string_view trimmed(std::string_view text);
// A to Z as a to z; all else as it is.
std::string lower_case(std::string_view text);
// Every line that is neither empty nor a comment behind #, trimmed, with its number from 1.
std::vector<std::pair<int, std::string>> content_lines(const std::string& text);
// kUnreadable: "line 3: "the start of it" must be ...".
tl::unexpected<Error> bad_line(int number, std::string_view line, std::string_view problem);
// The VALUE of a line "NAME = VALUE", trimmed; none for any other line.
std::optional<std::string_view> assigned_value(std::string_view line, std::string_view name);
// The whole text is one finite number.
bool parse_number(std::string_view text, double& number);
// Between commas, trimmed; at least one.
std::vector<std::string_view> cells_of(std::string_view row);
// The same where a cell may stand in quotation marks: "a, b" is one cell, and "" in it is one mark
// (RFC 4180).
std::vector<std::string> quoted_cells_of(std::string_view row);
// At least one cell is a number: the row is no heading.
bool has_number(const std::vector<std::string>& cells);

}  // namespace brainshift::io
