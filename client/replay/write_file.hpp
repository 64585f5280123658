// SPDX-License-Identifier: GPL-3.0-or-later
// A file is either the old one or the complete new one, never half of it.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/core/error.hpp"

namespace brainshift::client {

// Writes `bytes` beside `path` under a temporary name, syncs, renames over `path`. kWriteFailed names the
// file and the reason; the temporary file is removed then.
Status write_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace brainshift::client
