// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/surgery_truth.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "common/io/files/file_access.hpp"
#include "common/io/recording/record_chain.hpp"
#include "common/io/recording/sqlite_statement.hpp"

namespace brainshift::io {
namespace {

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
        return file_error(ErrorCode::kInvalidArgument, path,
                          "truth point " + kind + ": node " + std::to_string(bad) +
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
