// SPDX-License-Identifier: GPL-3.0-or-later
// Writes a surgery file of observations, as `brainshift replay` plays it.
#pragma once

#include <filesystem>
#include <vector>

#include "common/core/error.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/observation.hpp"

namespace brainshift::client {

// `path` must not exist. meta: the keys of surgery_file.hpp.
// kWriteFailed; leaves nothing behind then.
Status write_surgery(const std::filesystem::path& path, const io::SurgeryMeta& meta,
                     const std::vector<Observation>& observations);

}  // namespace brainshift::client
