// SPDX-License-Identifier: GPL-3.0-or-later
// Cells of the small .csv files that people write by hand.
#pragma once

#include <string_view>
#include <vector>

namespace brainshift::io {

// Without blanks at either end.
std::string_view trimmed(std::string_view text);
// The whole text is one finite number.
bool parse_number(std::string_view text, double& number);
// Between commas, trimmed; at least one.
std::vector<std::string_view> cells_of(std::string_view row);

}  // namespace brainshift::io
