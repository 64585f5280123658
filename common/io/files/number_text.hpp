// SPDX-License-Identifier: GPL-3.0-or-later
// Rows of numbers out of plain text; private to io.
#pragma once

#include <string>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::io {

// One row per line that is neither empty nor begins with '#' or "//"; numbers between blanks,
// tabs, commas or semicolons. kUnreadable names line and word. "nan" and "inf" are numbers here;
// the caller judges.
Result<std::vector<std::vector<double>>> parse_number_rows(const std::string& text);

}  // namespace brainshift::io
