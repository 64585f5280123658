// SPDX-License-Identifier: GPL-3.0-or-later
// Where the journal's records go: a surgery file, or a stand-in that fails on purpose.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "common/core/error.hpp"
#include "common/io/recording/surgery_file.hpp"

namespace brainshift::server {

using JournalMeta = io::SurgeryMeta;

class RecordSink {
 public:
  virtual ~RecordSink() = default;
  // All of them, and on the disk when it returns; or none of them.
  virtual Status append(std::span<const io::SurgeryRecord> records) = 0;
  // An error when what was appended is lost, because the file was deleted or replaced.
  virtual Status check() { return {}; }
  virtual Status close() = 0;
};
using OpenSink = std::function<Result<std::unique_ptr<RecordSink>>(
    const std::filesystem::path& path, const JournalMeta& meta)>;

// A new io::SurgeryFile.
Result<std::unique_ptr<RecordSink>> open_surgery_file(const std::filesystem::path& path,
                                                      const JournalMeta& meta);

// First free name "STEM.surgery", "STEM-2.surgery", ... beginning with `path`: neither it nor what
// a database keeps beside it exists, and it is not `but_not`.
std::filesystem::path free_path(const std::filesystem::path& path,
                                const std::filesystem::path& but_not = {});

// The free name for "<case>-<session>.surgery" in the folder; every character of the case id that
// is not a letter, digit, '-', '_' or '.' becomes '_'.
std::filesystem::path journal_path(const std::filesystem::path& folder, const std::string& case_id,
                                   const std::string& session);

}  // namespace brainshift::server
