// SPDX-License-Identifier: GPL-3.0-or-later
// What a model was made from: size and CRC-32 of the case and of every file that it names, so
// that a model that is older than its inputs can be told.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"

namespace brainshift::io {

struct InputFile {
  // The case's key that names the file ("images.brain", "mesh.file", ...), or "case" for the case
  // file. Of the latter, what it says counts (case_config_text), so that an edited comment does
  // not make a model stale.
  std::string key;
  std::filesystem::path path;
  std::uint64_t bytes = 0;
  std::uint32_t crc32 = 0;
};

// The inputs of a case as they are now, sorted by key; to be taken when they are read. The case
// itself is taken from `config` and left out when it was made in memory. kNotFound / kUnreadable
// name key and file.
Result<std::vector<InputFile>> record_inputs(const CaseConfig& config);

// Compares with the files on disk. kInvalidArgument names the first one that changed and says to
// prepare again. The value holds one sentence for each file that is not there any more: a model
// travels without its MRI.
Result<std::vector<std::string>> check_inputs(const std::vector<InputFile>& inputs);

}  // namespace brainshift::io
