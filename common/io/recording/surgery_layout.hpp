// SPDX-License-Identifier: GPL-3.0-or-later
// The tables of a surgery file, its version, its meta table, its seals and its truth; private to
// it. The layout itself is described in surgery_file.hpp.
#pragma once

#include <cstdint>
#include <optional>

#include "common/io/recording/sqlite_database.hpp"
#include "common/io/recording/surgery_record.hpp"

namespace brainshift::io {

inline constexpr int kSurgeryVersion = 2;

// A row of the seal table.
struct Seal {
  std::uint64_t records = 0;
  std::uint32_t crc = 0;
};

// What stands in front of the records.
struct SurgeryHeader {
  SurgeryMeta meta;
  std::uint32_t chain_start = 0;
};

// Tables and meta of a new file, on disk before the first record; then the write-ahead log.
// kWriteFailed.
Result<SurgeryHeader> create_layout(SqliteDatabase& database, const SurgeryMeta& meta);

// kUnreadable for another program's file, another version, a missing table, or a meta table that
// is not what was written; the last is let pass for a damaged file.
Result<SurgeryHeader> read_header(const SqliteDatabase& database, bool damaged);

// Present after close(), gone with the first record that is added.
Result<std::optional<Seal>> read_closed_seal(const SqliteDatabase& database);
Status write_closed_seal(const SqliteDatabase& database, const Seal& seal);
Status remove_closed_seal(const SqliteDatabase& database);

// ---- truth ----

// All rows of one observation's truth, or none. kNotFinite, kInvalidArgument or kWriteFailed.
Status write_truth_rows(const SqliteDatabase& database, std::int64_t sequence,
                        const SurgeryTruth& truth);

// kNotFound without truth for that observation; kUnreadable when it is not what was written.
Result<SurgeryTruth> read_truth_rows(const SqliteDatabase& database, std::int64_t sequence);

}  // namespace brainshift::io
