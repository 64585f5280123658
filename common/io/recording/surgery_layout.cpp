// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/surgery_layout.hpp"

#include <charconv>
#include <map>
#include <string>
#include <system_error>

#include "common/io/recording/record_chain.hpp"
#include "common/io/recording/sqlite_statement.hpp"

namespace brainshift::io {
namespace {

constexpr int kApplicationId = 0x42534652;  // "BSFR"; tells a surgery from any other SQLite file

constexpr const char* kSchema = R"sql(
CREATE TABLE meta(key TEXT PRIMARY KEY NOT NULL, value TEXT NOT NULL);
CREATE TABLE seal(
  name TEXT PRIMARY KEY NOT NULL CHECK (name IN ('meta', 'closed')),
  records INTEGER NOT NULL,
  crc INTEGER NOT NULL);
CREATE TABLE record(
  id INTEGER PRIMARY KEY,
  kind TEXT NOT NULL CHECK (kind IN ('observation', 'update', 'decision')),
  sequence INTEGER NOT NULL,
  recorded_ns INTEGER NOT NULL,
  payload BLOB NOT NULL,
  crc INTEGER NOT NULL);
CREATE TABLE truth_field(
  observation_sequence INTEGER PRIMARY KEY,
  nodes INTEGER NOT NULL,
  displacement BLOB NOT NULL,
  crc INTEGER NOT NULL);
CREATE TABLE truth_point(
  id INTEGER PRIMARY KEY,
  observation_sequence INTEGER NOT NULL,
  kind TEXT NOT NULL,
  node0 INTEGER NOT NULL, node1 INTEGER NOT NULL, node2 INTEGER NOT NULL, node3 INTEGER NOT NULL,
  weight0 REAL NOT NULL, weight1 REAL NOT NULL, weight2 REAL NOT NULL, weight3 REAL NOT NULL);
CREATE INDEX truth_point_by_observation ON truth_point(observation_sequence, id);
CREATE TABLE truth_scalar(
  observation_sequence INTEGER NOT NULL,
  name TEXT NOT NULL,
  value REAL NOT NULL,
  PRIMARY KEY (observation_sequence, name));
)sql";

// Preparing a statement fails where a table or a column is missing.
constexpr const char* kTables[] = {
    "SELECT id, kind, sequence, recorded_ns, payload, crc FROM record",
    "SELECT observation_sequence, nodes, displacement, crc FROM truth_field",
    "SELECT name, records, crc FROM seal",
    ("SELECT observation_sequence, kind, node0, node1, node2, node3, weight0, weight1, weight2, "
     "weight3 FROM truth_point"),
    "SELECT observation_sequence, name, value FROM truth_scalar"};

// Every key of the meta table is named once; MetaWriter and MetaReader walk the same list.
template <typename A, typename Meta>
void visit(A& a, Meta& meta) {
  a("case_id", meta.case_id), a("model_id", meta.model_id), a("case_file", meta.case_file);
  a("scenario", meta.scenario), a("seed", meta.seed), a("method", meta.method);
  a("boundary", meta.boundary), a("created_utc", meta.created_utc), a("software", meta.software);
  a("build", meta.build), a("machine", meta.machine), a("blas_kernel", meta.blas_kernel);
  a("continues", meta.continues), a("gap", meta.gap);
}

struct MetaWriter {
  std::map<std::string, std::string> rows;
  void operator()(const char* key, const std::string& value) {
    if (!value.empty()) rows[key] = value;
  }
  void operator()(const char* key, const std::optional<std::uint64_t>& value) {
    if (value) rows[key] = std::to_string(*value);
  }
};

struct MetaReader {
  std::map<std::string, std::string> rows;
  void operator()(const char* key, std::string& value) { value = rows[key]; }
  // A seed that is not a whole number counts as not given.
  void operator()(const char* key, std::optional<std::uint64_t>& value) {
    const std::string& text = rows[key];
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error == std::errc() && end == text.data() + text.size()) value = number;
  }
};

Status insert_seal(const SqliteDatabase& database, std::string_view name, const Seal& seal) {
  Statement insert(database.handle(),
                   "INSERT OR REPLACE INTO seal(name, records, crc) VALUES(?1, ?2, ?3)");
  if (!insert.bind_text(1, name)
           .bind(2, static_cast<std::int64_t>(seal.records))
           .bind(3, std::int64_t{seal.crc})
           .run()) {
    return database.write_failure("seal");
  }
  return {};
}

Result<std::optional<Seal>> read_seal(const SqliteDatabase& database, std::string_view name) {
  Statement select(database.handle(), "SELECT records, crc FROM seal WHERE name = ?1");
  if (select.bind_text(1, name).row()) {
    return Seal{static_cast<std::uint64_t>(select.integer(0)),
                static_cast<std::uint32_t>(select.integer(1))};
  }
  if (!select.ok()) return database.read_failure("seal");
  return std::optional<Seal>();
}

Status check_version(const SqliteDatabase& database) {
  const auto application = database.query("PRAGMA application_id");
  const auto version = database.query("PRAGMA user_version");
  if (!application || !version) return database.read_failure("surgery file");
  if (*application != std::to_string(kApplicationId)) {
    return database.unreadable("is not a surgery file");
  }
  if (*version == std::to_string(kSurgeryVersion)) return {};
  return database.unreadable("surgery file of version " + *version + ", must be version " +
                             std::to_string(kSurgeryVersion));
}

Status check_tables(const SqliteDatabase& database) {
  for (const char* sql : kTables) {
    if (!Statement(database.handle(), sql).ok()) return database.read_failure("surgery file");
  }
  return {};
}

}  // namespace

Result<SurgeryHeader> create_layout(SqliteDatabase& database, const SurgeryMeta& meta) {
  SurgeryHeader header;
  header.meta = meta;
  // Not in the log yet: a copy that was made without the log must still know what it is.
  if (!database.execute("PRAGMA synchronous = FULL")) {
    return database.write_failure("surgery file");
  }
  const std::string stamp = "PRAGMA application_id = " + std::to_string(kApplicationId) +
                            "; PRAGMA user_version = " + std::to_string(kSurgeryVersion) + ";";
  if (!database.execute("BEGIN IMMEDIATE") || !database.execute(kSchema) ||
      !database.execute(stamp)) {
    return database.write_failure("schema");
  }
  MetaWriter writer;
  visit(writer, meta);
  {
    Statement insert(database.handle(), "INSERT INTO meta(key, value) VALUES(?1, ?2)");
    for (const auto& [key, value] : writer.rows) {
      if (!insert.bind_text(1, key).bind_text(2, value).run()) {
        return database.write_failure("meta");
      }
    }
  }
  header.chain_start = chain_start(writer.rows);
  if (Status ok = insert_seal(database, "meta", {0, header.chain_start}); !ok) {
    return tl::unexpected(ok.error());
  }
  if (!database.execute("COMMIT")) return database.write_failure("meta");
  if (Status ok = database.use_log(); !ok) return tl::unexpected(ok.error());
  return header;
}

Result<SurgeryHeader> read_header(const SqliteDatabase& database, bool damaged) {
  if (Status ok = check_version(database); !ok) return tl::unexpected(ok.error());
  if (Status ok = check_tables(database); !ok) return tl::unexpected(ok.error());
  SurgeryHeader header;
  MetaReader reader;
  Statement select(database.handle(), "SELECT key, value FROM meta ORDER BY key");
  while (select.row()) reader.rows[select.bytes(0)] = select.bytes(1);
  if (!select.ok()) return database.read_failure("meta");
  header.chain_start = chain_start(reader.rows);
  const auto seal = read_seal(database, "meta");
  if (!seal && !damaged) return tl::unexpected(seal.error());
  const bool sealed = seal && *seal && (*seal)->crc == header.chain_start;
  if (!sealed && !damaged) return database.unreadable("meta: the checksum does not match");
  visit(reader, header.meta);
  return header;
}

Result<std::optional<Seal>> read_closed_seal(const SqliteDatabase& database) {
  return read_seal(database, "closed");
}

Status write_closed_seal(const SqliteDatabase& database, const Seal& seal) {
  return insert_seal(database, "closed", seal);
}

Status remove_closed_seal(const SqliteDatabase& database) {
  if (database.execute("DELETE FROM seal WHERE name = 'closed'")) return {};
  return database.write_failure("seal");
}

}  // namespace brainshift::io
