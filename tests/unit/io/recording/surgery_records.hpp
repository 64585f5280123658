// SPDX-License-Identifier: GPL-3.0-or-later
// Surgery files for the tests of this folder, and what stands in them.
#pragma once

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>
#include <string>
#include <vector>

#include "common/io/recording/surgery_file.hpp"

namespace brainshift::io {

// Observations and updates take turns; the payload, of some hundred bytes, names its record.
inline SurgeryRecord numbered_record(std::uint64_t sequence) {
  SurgeryRecord record;
  record.kind = sequence % 2 == 1 ? RecordKind::kObservation : RecordKind::kUpdate;
  record.sequence = sequence;
  record.recorded_ns = static_cast<std::int64_t>(sequence) * 1000;
  record.payload = "record " + std::to_string(sequence) + std::string(1, '\0');
  while (record.payload.size() < 400) record.payload += static_cast<char>(record.payload.size());
  return record;
}

inline void write_numbered(const std::filesystem::path& path, std::uint64_t records,
                           const SurgeryMeta& meta = {.case_id = "c", .model_id = "m"}) {
  auto file = SurgeryFile::create(path, meta);
  ASSERT_TRUE(file) << file.error().message;
  std::vector<SurgeryRecord> group;
  for (std::uint64_t i = 1; i <= records; ++i) group.push_back(numbered_record(i));
  ASSERT_TRUE(file->append(group));
  ASSERT_TRUE(file->close());
}

// Changes a file behind the back of SurgeryFile.
inline void run_sql(const std::filesystem::path& path, const char* sql) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
  ASSERT_EQ(sqlite3_close(db), SQLITE_OK);
}

// What visit() hands over before it ends, and how it ends.
struct Visited {
  std::vector<SurgeryRecord> records;
  Status status;
};
inline Visited visit_all(const SurgeryFile& file) {
  Visited visited;
  visited.status = file.visit([&](const SurgeryRecord& record) {
    visited.records.push_back(record);
    return Status();
  });
  return visited;
}

inline bool same(const SurgeryRecord& a, const SurgeryRecord& b) {
  return a.kind == b.kind && a.sequence == b.sequence && a.recorded_ns == b.recorded_ns &&
         a.payload == b.payload;
}

// The first records of what write_numbered() wrote, and nothing else.
inline bool is_prefix(const std::vector<SurgeryRecord>& records) {
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!same(records[i], numbered_record(i + 1))) return false;
  }
  return true;
}

}  // namespace brainshift::io
