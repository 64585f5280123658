// SPDX-License-Identifier: GPL-3.0-or-later
// A surgery file of observations, as `brainshift replay` plays it.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/values/observation.hpp"

namespace brainshift::client {

// A new file; nothing is left behind on failure. kWriteFailed, also when the file exists already. meta: surgery_file.hpp.
Status write_surgery(const std::filesystem::path& path,
                     const std::map<std::string, std::string>& meta,
                     const std::vector<Observation>& observations);

}  // namespace brainshift::client
