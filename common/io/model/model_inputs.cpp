// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/model/model_inputs.hpp"

#include <algorithm>

#include "common/configuration/case_keys.hpp"
#include "common/io/config/config_file.hpp"
#include "common/io/files/checksum.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

constexpr const char* kCase = "case";

FileChecksum case_checksum(const CaseConfig& config) {
  const std::string text = case_config_text(config);
  return {text.size(), crc32_of(text.data(), text.size())};
}

// A case that cannot be read any more differs from the one that could.
Result<FileChecksum> checksum_now(const InputFile& input) {
  if (input.key != kCase) return file_checksum(input.path);
  return read_case_config(input.path).map(case_checksum);
}

}  // namespace

Result<std::vector<InputFile>> record_inputs(const CaseConfig& config) {
  std::vector<InputFile> inputs;
  if (!config.file.empty()) {
    const FileChecksum text = case_checksum(config);
    inputs.push_back({kCase, config.file, text.bytes, text.crc32});
  }
  for (const auto& [key, path] : named_files(config)) {
    const Result<FileChecksum> found = file_checksum(path);
    if (!found) return fail(found.error().code, key + ": " + found.error().message);
    inputs.push_back({key, path, found->bytes, found->crc32});
  }
  std::sort(inputs.begin(), inputs.end(),
            [](const InputFile& a, const InputFile& b) { return a.key < b.key; });
  return inputs;
}

Result<std::vector<std::string>> check_inputs(const std::vector<InputFile>& inputs) {
  std::vector<std::string> notes;
  for (const InputFile& input : inputs) {
    if (const Status there = check_regular_file(input.path); !there) {
      notes.push_back(input.key + ": " + there.error().message +
                      "; whether the model is up to date with it is not known");
      continue;
    }
    const Result<FileChecksum> now = checksum_now(input);
    if (now && now->bytes == input.bytes && now->crc32 == input.crc32) continue;
    return invalid(
        input.key + ": " + input.path.string() +
        " has changed since the model was prepared from it: run brainshiftd prepare again");
  }
  return notes;
}

}  // namespace brainshift::io
