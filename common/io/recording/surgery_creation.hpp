// SPDX-License-Identifier: GPL-3.0-or-later
// What every maker of surgery files does beside writing records.
#pragma once

#include <filesystem>
#include <string>

namespace brainshift::io {

// Now, UTC, as ISO 8601 to the second: meta.created_utc.
std::string utc_now();

// Removes a surgery file that could not be completed, with what the database keeps beside it.
void discard_surgery(const std::filesystem::path& path);

}  // namespace brainshift::io
