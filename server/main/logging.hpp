// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace brainshift::server {

// Log to stderr, one line per event: time, level, then words and key=value pairs. level: trace,
// debug, info, warn or error.
void start_logging(const std::string& level);

}  // namespace brainshift::server
