// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/surgery_file.hpp"

#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include "common/io/files/file_access.hpp"
#include "common/io/recording/sqlite_statement.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "truth fields are little-endian blobs");

constexpr int kApplicationId = 0x42534652;  // "BSFR"; tells a surgery from any other SQLite file
constexpr int kSchemaVersion = 1;
constexpr int kBusyTimeoutMs = 500;
constexpr std::string_view kWrite = "cannot write";
constexpr std::string_view kRead = "cannot read";

constexpr const char* kSchema = R"sql(
CREATE TABLE meta(key TEXT PRIMARY KEY NOT NULL, value TEXT NOT NULL);
CREATE TABLE record(
  id INTEGER PRIMARY KEY,
  kind TEXT NOT NULL CHECK (kind IN ('observation', 'update')),
  sequence INTEGER NOT NULL,
  recorded_ns INTEGER NOT NULL,
  payload BLOB NOT NULL);
CREATE TABLE truth_field(
  observation_sequence INTEGER PRIMARY KEY,
  nodes INTEGER NOT NULL,
  displacement BLOB NOT NULL);
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

constexpr const char* kInsertRecord =
    "INSERT INTO record(kind, sequence, recorded_ns, payload) VALUES(?1, ?2, ?3, ?4)";
constexpr const char* kSelectRecords =
    "SELECT sequence, recorded_ns, payload FROM record WHERE kind = ?1 ORDER BY id";
constexpr const char* kSelectField =
    "SELECT nodes, displacement FROM truth_field WHERE observation_sequence = ?1";
constexpr const char* kSelectPoints =
    "SELECT kind, node0, node1, node2, node3, weight0, weight1, weight2, weight3 FROM truth_point"
    " WHERE observation_sequence = ?1 ORDER BY id";
constexpr const char* kSelectScalars =
    "SELECT name, value FROM truth_scalar WHERE observation_sequence = ?1";

// Every key of the meta table is named once; MetaWriter and MetaReader walk the same list.
template <typename A, typename Meta>
void visit(A& a, Meta& meta) {
  a("case_id", meta.case_id), a("model_id", meta.model_id), a("case_file", meta.case_file);
  a("scenario", meta.scenario), a("seed", meta.seed), a("method", meta.method);
  a("boundary", meta.boundary), a("created_utc", meta.created_utc), a("software", meta.software);
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

// SQLite integers are signed; a sequence beyond them would come back negative.
bool fits(std::uint64_t sequence) {
  return sequence <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
}

Status check_truth(const fs::path& path, const SurgeryTruth& truth) {
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

}  // namespace

std::string_view to_string(RecordKind kind) {
  return kind == RecordKind::kObservation ? "observation" : "update";
}

void discard_surgery(const fs::path& path) {
  for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
    std::error_code ignored;
    fs::remove(fs::path(path) += suffix, ignored);
  }
}

struct SurgeryFile::Impl {
  fs::path path;
  sqlite3* db = nullptr;
  bool writable = false;
  SurgeryMeta meta;
  std::unique_ptr<Statement> insert_record;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    insert_record.reset();
    sqlite3_close_v2(db);
  }

  // "PATH: cannot write record: database or disk is full"
  tl::unexpected<Error> failure(ErrorCode code, std::string_view action,
                                std::string_view what) const {
    return file_error(code, path,
                      std::string(action) + " " + std::string(what) + ": " +
                          (db ? sqlite3_errmsg(db) : "the file is closed"));
  }
  tl::unexpected<Error> write_failure(std::string_view what) const {
    return failure(ErrorCode::kWriteFailed, kWrite, what);
  }
  tl::unexpected<Error> read_failure(std::string_view what) const {
    return failure(ErrorCode::kUnreadable, kRead, what);
  }

  bool execute(const std::string& sql) const {
    return sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
  }
  // The first column of the only row; nullopt on failure.
  std::optional<std::string> query(const std::string& sql) const {
    Statement statement(db, sql.c_str());
    if (!statement.row()) return std::nullopt;
    return statement.bytes(0);
  }

  Status connect(int flags) {
    // Absolute: SQLite gives a meaning to names such as ":memory:" and "file:...".
    if (sqlite3_open_v2(fs::absolute(path).c_str(), &db, flags, nullptr) != SQLITE_OK) {
      return read_failure("surgery file");
    }
    sqlite3_extended_result_codes(db, 1);
    sqlite3_busy_timeout(db, kBusyTimeoutMs);
    return {};
  }

  Status initialise();
  Status verify();
  Status check_writable(std::string_view what) const;
  Status write_truth_rows(std::int64_t sequence, const SurgeryTruth& truth) const;
  Status fold_log() const;
};

Status SurgeryFile::Impl::initialise() {
  // WAL and FULL before the first row, so that nothing is ever acknowledged without them.
  if (query("PRAGMA journal_mode = WAL") != "wal" || !execute("PRAGMA synchronous = FULL") ||
      query("PRAGMA synchronous") != "2") {
    return write_failure("surgery file");
  }
  const std::string header = "PRAGMA application_id = " + std::to_string(kApplicationId) +
                             "; PRAGMA user_version = " + std::to_string(kSchemaVersion) + ";";
  if (!execute("BEGIN IMMEDIATE") || !execute(kSchema) || !execute(header)) {
    return write_failure("schema");
  }
  Statement insert(db, "INSERT INTO meta(key, value) VALUES(?1, ?2)");
  MetaWriter writer;
  visit(writer, meta);
  for (const auto& [key, value] : writer.rows) {
    if (!insert.bind_text(1, key).bind_text(2, value).run()) return write_failure("meta");
  }
  if (!execute("COMMIT")) return write_failure("meta");
  writable = true;
  return {};
}

Status SurgeryFile::Impl::verify() {
  const auto application = query("PRAGMA application_id");
  const auto version = query("PRAGMA user_version");
  if (!application || !version) return read_failure("surgery file");
  if (*application != std::to_string(kApplicationId)) {
    return file_error(ErrorCode::kUnreadable, path, "is not a surgery file");
  }
  if (*version != std::to_string(kSchemaVersion)) {
    return file_error(ErrorCode::kUnreadable, path,
                      "surgery file of version " + *version + ", must be version " +
                          std::to_string(kSchemaVersion));
  }
  for (const char* sql : {kSelectRecords, kSelectField, kSelectPoints, kSelectScalars}) {
    if (!Statement(db, sql).ok()) return read_failure("surgery file");
  }
  // SQLite notices missing pages but fills up a torn last one; with a write-ahead log the file
  // itself may rightly be torn, and the log mends it.
  std::error_code ignored;
  const auto page_size = query("PRAGMA page_size");
  const auto log_bytes = fs::file_size(fs::path(path) += "-wal", ignored);
  const bool has_log = !ignored && log_bytes > 0;
  const auto bytes = fs::file_size(path, ignored);
  if (!page_size || (!has_log && bytes % std::stoull(*page_size) != 0)) {
    return file_error(ErrorCode::kUnreadable, path, "is truncated");
  }
  Statement select(db, "SELECT key, value FROM meta");
  MetaReader reader;
  while (select.row()) reader.rows[select.bytes(0)] = select.bytes(1);
  if (!select.ok()) return read_failure("meta");
  visit(reader, meta);
  return {};
}

Status SurgeryFile::Impl::check_writable(std::string_view what) const {
  if (db == nullptr) return write_failure(what);
  if (!writable) {
    return file_error(ErrorCode::kWriteFailed, path,
                      "cannot write " + std::string(what) + ": opened for reading");
  }
  return {};
}

Status SurgeryFile::Impl::write_truth_rows(std::int64_t sequence, const SurgeryTruth& truth) const {
  const auto bytes = static_cast<std::size_t>(truth.displacement.size()) * sizeof(double);
  Statement field(db, "INSERT INTO truth_field VALUES(?1, ?2, ?3)");
  if (!field.bind(1, sequence)
           .bind(2, std::int64_t{truth.displacement.cols()})
           .bind_blob(3, truth.displacement.data(), bytes)
           .run()) {
    return write_failure("truth_field");
  }
  Statement insert(db,
                   "INSERT INTO truth_point VALUES(NULL, ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)");
  for (const auto& [kind, points] : truth.points) {
    for (const ScorePoint& point : points) {
      insert.bind(1, sequence).bind_text(2, kind);
      for (int i = 0; i < 4; ++i) {
        insert.bind(3 + i, std::int64_t{point.nodes[i]}).bind(7 + i, point.weights[i]);
      }
      if (!insert.run()) return write_failure("truth_point");
    }
  }
  Statement scalar(db, "INSERT INTO truth_scalar VALUES(?1, ?2, ?3)");
  for (const auto& [name, value] : truth.scalars) {
    if (!scalar.bind(1, sequence).bind_text(2, name).bind(3, value).run()) {
      return write_failure("truth_scalar");
    }
  }
  return {};
}

// Leaving WAL mode needs every page in the main file and nobody else on it.
Status SurgeryFile::Impl::fold_log() const {
  const auto busy = query("PRAGMA wal_checkpoint(TRUNCATE)");
  if (!busy) return write_failure("write-ahead log back");
  if (*busy != "0" || query("PRAGMA journal_mode = DELETE") != "delete") {
    return file_error(ErrorCode::kWriteFailed, path,
                      "cannot fold the write-ahead log back: the file is in use");
  }
  return {};
}

SurgeryFile::SurgeryFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SurgeryFile::SurgeryFile(SurgeryFile&&) noexcept = default;
SurgeryFile& SurgeryFile::operator=(SurgeryFile&&) noexcept = default;
// Without close() SQLite folds the log as well as it can; nobody is left to be told of a failure.
SurgeryFile::~SurgeryFile() = default;

Result<SurgeryFile> SurgeryFile::create(const fs::path& path, const SurgeryMeta& meta) {
  // O_EXCL reserves the name: two programs cannot both create the file. SQLite accepts it empty.
  const int reserved = ::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0644);
  if (reserved < 0) {
    return file_error(
        ErrorCode::kWriteFailed, path,
        errno == EEXIST ? "exists already" : std::string("cannot create: ") + std::strerror(errno));
  }
  ::close(reserved);
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  impl->meta = meta;
  Status status = impl->connect(SQLITE_OPEN_READWRITE);
  if (status) status = impl->initialise();
  if (!status) {
    impl.reset();
    discard_surgery(path);
    return fail(ErrorCode::kWriteFailed, status.error().message);
  }
  return SurgeryFile(std::move(impl));
}

Result<SurgeryFile> SurgeryFile::open(const fs::path& path) {
  if (Status status = check_regular_file(path); !status) return tl::unexpected(status.error());
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  if (Status status = impl->connect(SQLITE_OPEN_READONLY); !status) {
    return tl::unexpected(status.error());
  }
  if (Status status = impl->verify(); !status) return tl::unexpected(status.error());
  return SurgeryFile(std::move(impl));
}

Result<SurgeryFile> SurgeryFile::open_to_append(const fs::path& path) {
  // SQLite opens a file that it may not write for reading only, without a word.
  if (Status status = check_regular_file(path); !status) return tl::unexpected(status.error());
  if (::access(path.c_str(), W_OK) != 0) {
    return file_error(ErrorCode::kWriteFailed, path,
                      std::string("cannot be written: ") + std::strerror(errno));
  }
  // What is no surgery is told before anything of it is touched.
  {
    auto readable = open(path);
    if (!readable) return tl::unexpected(readable.error());
    if (Status status = readable->close(); !status) return tl::unexpected(status.error());
  }
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  if (Status status = impl->connect(SQLITE_OPEN_READWRITE); !status) {
    return tl::unexpected(status.error());
  }
  if (impl->query("PRAGMA journal_mode = WAL") != "wal" ||
      !impl->execute("PRAGMA synchronous = FULL")) {
    return impl->write_failure("surgery file");
  }
  if (Status status = impl->verify(); !status) return tl::unexpected(status.error());
  impl->writable = true;
  return SurgeryFile(std::move(impl));
}

Status SurgeryFile::append(const SurgeryRecord& record) {
  if (Status status = impl_->check_writable("record"); !status) return status;
  if (!fits(record.sequence)) {
    return file_error(
        ErrorCode::kInvalidArgument, impl_->path,
        "record of sequence " + std::to_string(record.sequence) + ": must be below 2^63");
  }
  if (!impl_->insert_record) {
    impl_->insert_record = std::make_unique<Statement>(impl_->db, kInsertRecord);
  }
  const bool written = impl_->insert_record->bind_text(1, to_string(record.kind))
                           .bind(2, static_cast<std::int64_t>(record.sequence))
                           .bind(3, record.recorded_ns)
                           .bind_blob(4, record.payload.data(), record.payload.size())
                           .run();
  if (written) return {};
  Status status = impl_->write_failure("record");
  impl_->insert_record.reset();  // a failed statement is not reused
  return status;
}

Status SurgeryFile::write_truth(std::uint64_t observation_sequence, const SurgeryTruth& truth) {
  if (Status status = impl_->check_writable("truth"); !status) return status;
  if (Status status = check_truth(impl_->path, truth); !status) return status;
  if (!fits(observation_sequence)) {
    return file_error(ErrorCode::kInvalidArgument, impl_->path,
                      "truth: sequence must be below 2^63");
  }
  if (!impl_->execute("BEGIN IMMEDIATE")) return impl_->write_failure("truth");
  Status status = impl_->write_truth_rows(static_cast<std::int64_t>(observation_sequence), truth);
  if (status && !impl_->execute("COMMIT")) status = impl_->write_failure("truth");
  // After some errors SQLite has rolled back by itself; then there is nothing left to undo.
  if (!status && sqlite3_get_autocommit(impl_->db) == 0) impl_->execute("ROLLBACK");
  return status;
}

Status SurgeryFile::close() {
  if (impl_->db == nullptr) return {};
  impl_->insert_record.reset();
  Status status;
  if (impl_->writable) status = impl_->fold_log();
  if (sqlite3_close(impl_->db) != SQLITE_OK) {
    if (status) status = impl_->write_failure("surgery file");
    return status;
  }
  impl_->db = nullptr;
  return status;
}

const SurgeryMeta& SurgeryFile::meta() const { return impl_->meta; }

Result<std::vector<SurgeryRecord>> SurgeryFile::records(RecordKind kind) const {
  if (impl_->db == nullptr) return impl_->read_failure("records");
  std::vector<SurgeryRecord> records;
  Statement select(impl_->db, kSelectRecords);
  select.bind_text(1, to_string(kind));
  while (select.row()) {
    records.push_back(
        {kind, static_cast<std::uint64_t>(select.integer(0)), select.integer(1), select.bytes(2)});
  }
  if (!select.ok()) return impl_->read_failure("records");
  return records;
}

Result<SurgeryTruth> SurgeryFile::read_truth(std::uint64_t observation_sequence) const {
  if (impl_->db == nullptr) return impl_->read_failure("truth");
  const auto sequence = static_cast<std::int64_t>(observation_sequence);
  Statement field(impl_->db, kSelectField);
  if (!field.bind(1, sequence).row()) {
    if (!field.ok()) return impl_->read_failure("truth");
    return file_error(ErrorCode::kNotFound, impl_->path,
                      "no truth for observation " + std::to_string(observation_sequence));
  }
  SurgeryTruth truth;
  const std::int64_t nodes = field.integer(0);
  const std::string blob = field.bytes(1);
  if (nodes < 0 || blob.size() / (3 * sizeof(double)) != static_cast<std::uint64_t>(nodes) ||
      blob.size() % (3 * sizeof(double)) != 0) {
    return file_error(ErrorCode::kUnreadable, impl_->path,
                      "truth field of " + std::to_string(nodes) + " nodes has " +
                          std::to_string(blob.size()) + " bytes");
  }
  truth.displacement.resize(3, nodes);
  if (!blob.empty()) std::memcpy(truth.displacement.data(), blob.data(), blob.size());

  Statement points(impl_->db, kSelectPoints);
  points.bind(1, sequence);
  while (points.row()) {
    ScorePoint point;
    for (int i = 0; i < 4; ++i) {
      point.nodes[i] = static_cast<int>(points.integer(1 + i));
      point.weights[i] = points.real(5 + i);
    }
    truth.points[points.bytes(0)].push_back(point);
  }
  Statement scalars(impl_->db, kSelectScalars);
  scalars.bind(1, sequence);
  while (scalars.row()) truth.scalars[scalars.bytes(0)] = scalars.real(1);
  if (!points.ok() || !scalars.ok()) return impl_->read_failure("truth");
  if (Status status = check_truth(impl_->path, truth); !status) {
    return fail(ErrorCode::kUnreadable, status.error().message);
  }
  return truth;
}

}  // namespace brainshift::io
