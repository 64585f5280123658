// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/surgery_layout.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <system_error>

#include "common/io/files/file_access.hpp"
#include "common/io/recording/record_chain.hpp"

namespace brainshift::io {
namespace {

// ---- tables, meta and seals ----

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

// ---- truth ----

static_assert(std::endian::native == std::endian::little, "truth fields are little-endian blobs");

constexpr const char* kInsertField =
    "INSERT INTO truth_field(observation_sequence, nodes, displacement, crc)"
    " VALUES(?1, ?2, ?3, ?4)";
constexpr const char* kSelectField =
    "SELECT nodes, displacement, crc FROM truth_field WHERE observation_sequence = ?1";
constexpr const char* kSelectPoints =
    "SELECT kind, node0, node1, node2, node3, weight0, weight1, weight2, weight3 FROM truth_point"
    " WHERE observation_sequence = ?1 ORDER BY id";
constexpr const char* kSelectScalars =
    "SELECT name, value FROM truth_scalar WHERE observation_sequence = ?1";

Status check_truth(const std::filesystem::path& path, const SurgeryTruth& truth) {
  const auto nodes = static_cast<int>(truth.displacement.cols());
  if (!truth.displacement.allFinite()) {
    return file_error(ErrorCode::kNotFinite, path, "truth displacement is not finite");
  }
  for (const auto& [kind, points] : truth.points) {
    for (const ScorePoint& point : points) {
      if (!point.weights.allFinite()) {
        return file_error(ErrorCode::kNotFinite, path, "truth point " + kind + ": weight");
      }
      if (point.nodes.minCoeff() < 0 || point.nodes.maxCoeff() >= nodes) {
        const int bad =
            point.nodes.minCoeff() < 0 ? point.nodes.minCoeff() : point.nodes.maxCoeff();
        return invalid_file(path, "truth point " + kind + ": node " + std::to_string(bad) +
                                      ", must be in [0, " + std::to_string(nodes) + ")");
      }
    }
  }
  for (const auto& [name, value] : truth.scalars) {
    if (!std::isfinite(value)) {
      return file_error(ErrorCode::kNotFinite, path, "truth scalar " + name + " is not finite");
    }
  }
  return {};
}

Status insert_rows(const SqliteDatabase& database, std::int64_t sequence,
                   const SurgeryTruth& truth) {
  sqlite3* db = database.handle();
  const auto bytes = static_cast<std::size_t>(truth.displacement.size()) * sizeof(double);
  Statement field(db, kInsertField);
  field.bind(1, sequence)
      .bind(2, std::int64_t{truth.displacement.cols()})
      .bind_blob(3, truth.displacement.data(), bytes)
      .bind(4, std::int64_t{truth_checksum(sequence, truth)});
  if (!field.run()) return database.write_failure("truth_field");
  Statement insert(db,
                   "INSERT INTO truth_point VALUES(NULL, ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)");
  for (const auto& [kind, points] : truth.points) {
    for (const ScorePoint& point : points) {
      insert.bind(1, sequence).bind_text(2, kind);
      for (int i = 0; i < 4; ++i) {
        insert.bind(3 + i, std::int64_t{point.nodes[i]}).bind(7 + i, point.weights[i]);
      }
      if (!insert.run()) return database.write_failure("truth_point");
    }
  }
  Statement scalar(db, "INSERT INTO truth_scalar VALUES(?1, ?2, ?3)");
  for (const auto& [name, value] : truth.scalars) {
    if (!scalar.bind(1, sequence).bind_text(2, name).bind(3, value).run()) {
      return database.write_failure("truth_scalar");
    }
  }
  return {};
}

// The field and what the file says its checksum is.
Result<std::uint32_t> read_field(const SqliteDatabase& database, std::int64_t sequence,
                                 Points& displacement) {
  Statement field(database.handle(), kSelectField);
  if (!field.bind(1, sequence).row()) {
    if (!field.ok()) return database.read_failure("truth");
    return file_error(ErrorCode::kNotFound, database.path(),
                      "no truth for observation " + std::to_string(sequence));
  }
  const std::int64_t nodes = field.integer(0);
  const std::string blob = field.bytes(1);
  if (nodes < 0 || blob.size() / (3 * sizeof(double)) != static_cast<std::uint64_t>(nodes) ||
      blob.size() % (3 * sizeof(double)) != 0) {
    return database.unreadable("truth field of " + std::to_string(nodes) + " nodes has " +
                               std::to_string(blob.size()) + " bytes");
  }
  displacement.resize(3, nodes);
  if (!blob.empty()) std::memcpy(displacement.data(), blob.data(), blob.size());
  return static_cast<std::uint32_t>(field.integer(2));
}

}  // namespace

Result<SurgeryHeader> create_layout(SqliteDatabase& database, const SurgeryMeta& meta) {
  SurgeryHeader header;
  header.meta = meta;
  // Not in the log yet: a copy that was made without the log must still know what it is.
  if (!database.execute("PRAGMA synchronous = FULL")) return database.write_failure("surgery file");
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

Status write_truth_rows(const SqliteDatabase& database, std::int64_t sequence,
                        const SurgeryTruth& truth) {
  if (Status ok = check_truth(database.path(), truth); !ok) return ok;
  if (!database.execute("BEGIN IMMEDIATE")) return database.write_failure("truth");
  Status status = insert_rows(database, sequence, truth);
  if (status && !database.execute("COMMIT")) status = database.write_failure("truth");
  // After some errors SQLite has rolled back by itself; then there is nothing left to undo.
  if (!status && sqlite3_get_autocommit(database.handle()) == 0) database.execute("ROLLBACK");
  return status;
}

Result<SurgeryTruth> read_truth_rows(const SqliteDatabase& database, std::int64_t sequence) {
  SurgeryTruth truth;
  const auto checksum = read_field(database, sequence, truth.displacement);
  if (!checksum) return tl::unexpected(checksum.error());
  Statement points(database.handle(), kSelectPoints);
  points.bind(1, sequence);
  while (points.row()) {
    ScorePoint point;
    for (int i = 0; i < 4; ++i) {
      point.nodes[i] = static_cast<int>(points.integer(1 + i));
      point.weights[i] = points.real(5 + i);
    }
    truth.points[points.bytes(0)].push_back(point);
  }
  Statement scalars(database.handle(), kSelectScalars);
  scalars.bind(1, sequence);
  while (scalars.row()) truth.scalars[scalars.bytes(0)] = scalars.real(1);
  if (!points.ok() || !scalars.ok()) return database.read_failure("truth");
  if (*checksum != truth_checksum(sequence, truth)) {
    return database.unreadable("truth of observation " + std::to_string(sequence) +
                               ": the checksum does not match");
  }
  if (Status ok = check_truth(database.path(), truth); !ok) {
    return fail(ErrorCode::kUnreadable, ok.error().message);
  }
  return truth;
}

}  // namespace brainshift::io
