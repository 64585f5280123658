// SPDX-License-Identifier: GPL-3.0-or-later
// A part of a surgery file as a new file. The original is only read.
//
// The new file is of the present version, closed, with the meta of the original; its gap says from
// which file it was taken and what is left out. It is written under a temporary name and renamed.
// `out` must not exist. Truth goes along for the observations that are kept, as far as it can be
// read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "common/core/error.hpp"

namespace brainshift::client {

struct CopiedJournal {
  std::uint64_t kept = 0;       // records
  std::uint64_t of = 0;         // records that the original counts
  std::optional<Error> broken;  // what ended the valid prefix
};

// The valid prefix. kNotFound or kUnreadable when nothing of the file can be read; kEmptySet
// without a valid record; kWriteFailed.
Result<CopiedJournal> repair_journal(const std::filesystem::path& file,
                                     const std::filesystem::path& out);

// Observations with these sequences, from first to last, of every source; the updates and
// decisions that answer them. Every record must be good. As above; kInvalidArgument when first is
// above last; kEmptySet when no record is in the range.
Result<CopiedJournal> trim_journal(const std::filesystem::path& file, std::uint64_t first,
                                   std::uint64_t last, const std::filesystem::path& out);

}  // namespace brainshift::client
