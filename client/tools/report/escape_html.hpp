// SPDX-License-Identifier: GPL-3.0-or-later
// Text of reports and case files inside an HTML page.
#pragma once

#include <string>
#include <string_view>

namespace brainshift::client {

// `text` with &, <, >, " and ' replaced by their entities.
std::string escape_html(std::string_view text);

}  // namespace brainshift::client
