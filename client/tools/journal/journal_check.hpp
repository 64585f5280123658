// SPDX-License-Identifier: GPL-3.0-or-later
// What a surgery file holds, and whether all of it is what was written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/io/recording/surgery_file.hpp"

namespace brainshift::client {

// Sequence numbers as they stand in a file.
struct Numbers {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  std::uint64_t count = 0;

  void add(std::uint64_t sequence);
  // Numbers between first and last that do not occur; 0 too when some occur twice.
  std::uint64_t left_out() const;
};

struct JournalCheck {
  std::filesystem::path file;
  io::SurgeryMeta meta;
  io::SurgeryState state;
  std::uint64_t records = 0;                    // that are proved
  std::map<std::string, Numbers> observations;  // by source
  Numbers updates;
  std::map<std::string, std::uint64_t> decisions;  // by outcome: how many
  // The first thing that is not what was written; the message names file and record.
  std::optional<Error> broken;
};

// kNotFound or kUnreadable when nothing of the file can be read.
Result<JournalCheck> check_journal(const std::filesystem::path& path);

// For people: the file, its records, its checksums, its gaps.
std::vector<std::string> report_lines(const JournalCheck& check);

}  // namespace brainshift::client
