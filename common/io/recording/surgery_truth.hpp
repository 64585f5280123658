// SPDX-License-Identifier: GPL-3.0-or-later
// The truth tables of a surgery file; private to it.
#pragma once

#include <cstdint>

#include "common/io/recording/sqlite_database.hpp"
#include "common/io/recording/surgery_record.hpp"

namespace brainshift::io {

// All rows of one observation's truth, or none. kNotFinite, kInvalidArgument or kWriteFailed.
Status write_truth_rows(const SqliteDatabase& database, std::int64_t sequence,
                        const SurgeryTruth& truth);

// kNotFound without truth for that observation; kUnreadable when it is not what was written.
Result<SurgeryTruth> read_truth_rows(const SqliteDatabase& database, std::int64_t sequence);

}  // namespace brainshift::io
