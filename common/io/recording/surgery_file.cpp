// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/surgery_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <limits>
#include <utility>

#include "common/io/files/file_access.hpp"
#include "common/io/recording/record_chain.hpp"
#include "common/io/recording/sqlite_database.hpp"
#include "common/io/recording/surgery_layout.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;
using Access = SqliteDatabase::Access;

constexpr const char* kInsert =
    "INSERT INTO record(kind, sequence, recorded_ns, payload, crc) VALUES(?1, ?2, ?3, ?4, ?5)";
constexpr const char* kSelect =
    "SELECT id, kind, sequence, recorded_ns, payload, crc FROM record ORDER BY id";

constexpr const char* kSelectNewest =
    "SELECT a.id, a.kind, a.sequence, a.recorded_ns, a.payload, a.crc, b.crc FROM record a "
    "LEFT JOIN record b ON b.id = a.id - 1 WHERE a.kind = ?1 ORDER BY a.id DESC";

// SQLite integers are signed; a sequence beyond them would come back negative.
bool fits(std::uint64_t sequence) {
  return sequence <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
}

std::optional<RecordKind> kind_of(std::string_view text) {
  for (const RecordKind kind :
       {RecordKind::kObservation, RecordKind::kUpdate, RecordKind::kDecision}) {
    if (text == to_string(kind)) return kind;
  }
  return std::nullopt;
}

}  // namespace

std::string describe(const SurgeryState& state) {
  const std::string count =
      fmt::format("{} record{}", state.records, state.records == 1 ? "" : "s");
  if (state.closed) return count + ", closed";
  return count + (state.log_beside
                      ? ", not closed: it crashed or is still written; its -wal file is beside it, "
                        "which may have lost its end"
                      : ", not closed: its end is missing if a -wal file was left behind");
}

void discard_surgery(const fs::path& path) {
  for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
    std::error_code ignored;
    fs::remove(fs::path(path) += suffix, ignored);
  }
}

struct SurgeryFile::Impl {
  // The end of the chain.
  struct Tail {
    std::uint64_t records = 0;
    std::uint32_t crc = 0;
  };

  explicit Impl(const fs::path& path) : database(path) {}

  SqliteDatabase database;
  bool writable = false;
  SurgeryHeader header;
  SurgeryState state;
  Tail tail;                          // of a file that is written
  std::unique_ptr<Statement> insert;  // goes before the database

  static Result<std::unique_ptr<Impl>> open(const fs::path& path, Access access) {
    const bool damaged = access == Access::kReadDamaged;
    if (Status ok = check_regular_file(path); !ok) return tl::unexpected(ok.error());
    auto impl = std::make_unique<Impl>(path);
    if (Status ok = impl->database.connect(access); !ok) return tl::unexpected(ok.error());
    auto header = read_header(impl->database, damaged);
    if (!header) return tl::unexpected(header.error());
    impl->header = std::move(*header);
    if (Status ok = impl->describe_state(damaged); !ok) return tl::unexpected(ok.error());
    return impl;
  }

  Status describe_state(bool damaged) {
    state.log_beside = database.has_log();
    if (!damaged) {
      if (Status ok = check_length(); !ok) return ok;
    }
    const auto seal = read_closed_seal(database);
    const auto last = database.query("SELECT coalesce(max(id), 0) FROM record");
    if (damaged) {
      state.closed = seal && seal->has_value();
      state.records = last ? std::stoull(*last) : 0;
      return {};
    }
    if (!seal) return tl::unexpected(seal.error());
    if (!last) return database.read_failure("records");
    state.closed = seal->has_value();
    state.records = std::stoull(*last);
    if (state.closed && (*seal)->records != state.records) {
      return database.unreadable(
          fmt::format("was closed with {} records, but holds {}", (*seal)->records, state.records));
    }
    return {};
  }

  // SQLite notices missing pages but fills up a torn last one; with a write-ahead log the file
  // itself may rightly be torn, and the log mends it.
  Status check_length() const {
    const auto page_size = database.query("PRAGMA page_size");
    std::error_code ignored;
    const auto bytes = fs::file_size(database.path(), ignored);
    if (!page_size || (!state.log_beside && bytes % std::stoull(*page_size) != 0)) {
      return database.unreadable("is truncated");
    }
    return {};
  }

  Status check_writable(std::string_view what) const {
    if (database.handle() == nullptr) return database.write_failure(what);
    if (!writable) {
      return write_failed(database.path(),
                          "cannot write " + std::string(what) + ": opened for reading");
    }
    return {};
  }

  Status insert_records(std::span<const SurgeryRecord> records, Tail& end) {
    if (!insert) insert = std::make_unique<Statement>(database.handle(), kInsert);
    for (const SurgeryRecord& record : records) {
      end = {end.records + 1, chain_link(end.crc, record)};
      insert->bind_text(1, to_string(record.kind))
          .bind(2, static_cast<std::int64_t>(record.sequence))
          .bind(3, record.recorded_ns)
          .bind_blob(4, record.payload.data(), record.payload.size())
          .bind(5, std::int64_t{end.crc});
      if (!insert->run()) return database.write_failure("record");
    }
    return {};
  }

  Result<Tail> walk(const std::function<Status(const SurgeryRecord&)>& visitor) const {
    Tail end{0, header.chain_start};
    Statement select(database.handle(), kSelect);
    while (select.row()) {
      const std::uint64_t id = end.records + 1;
      const auto kind = kind_of(select.bytes(1));
      if (!kind) return broken(id, "its kind is unknown");
      const SurgeryRecord record{*kind, static_cast<std::uint64_t>(select.integer(2)),
                                 select.integer(3), select.bytes(4)};
      end = {id, chain_link(end.crc, record)};
      if (select.integer(0) != static_cast<std::int64_t>(id)) {
        return broken(id, fmt::format("is missing; record {} follows", select.integer(0)));
      }
      if (select.integer(5) != std::int64_t{end.crc}) {
        return broken(id, "the checksum does not match; it, or the order, was changed");
      }
      if (Status ok = visitor(record); !ok) return tl::unexpected(ok.error());
    }
    if (!select.ok()) {
      return broken(end.records + 1,
                    std::string("cannot be read: ") + sqlite3_errmsg(database.handle()));
    }
    return end;
  }

  Status check_end(const Tail& end) const {
    const auto seal = read_closed_seal(database);
    if (!seal) return tl::unexpected(seal.error());
    if (!*seal) return {};
    const Seal expected{end.records, chain_end(end.crc, end.records)};
    if ((*seal)->records != expected.records) {
      return broken(end.records + 1, fmt::format("is missing; the file was closed with {} records",
                                                 (*seal)->records));
    }
    if ((*seal)->crc != expected.crc) return database.unreadable("the closing seal does not match");
    return {};
  }

  tl::unexpected<Error> broken(std::uint64_t id, const std::string& reason) const {
    return database.unreadable(fmt::format("record {}: {}", id, reason));
  }
};

SurgeryFile::SurgeryFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SurgeryFile::SurgeryFile(SurgeryFile&&) noexcept = default;
SurgeryFile& SurgeryFile::operator=(SurgeryFile&&) noexcept = default;
SurgeryFile::~SurgeryFile() = default;

Result<SurgeryFile> SurgeryFile::create(const fs::path& path, const SurgeryMeta& meta) {
  // O_EXCL reserves the name: two programs cannot both create the file. SQLite accepts it empty,
  // and gives what it keeps beside it the same mode.
  const int reserved = ::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600);
  if (reserved < 0) {
    return write_failed(path, errno == EEXIST
                                  ? "exists already"
                                  : std::string("cannot create: ") + std::strerror(errno));
  }
  ::close(reserved);
  auto impl = std::make_unique<Impl>(path);
  Result<SurgeryHeader> header;
  if (Status ok = impl->database.connect(Access::kWrite); !ok) {
    header = tl::unexpected(ok.error());
  } else {
    header = create_layout(impl->database, meta);
  }
  if (!header) {
    impl.reset();
    discard_surgery(path);
    return fail(ErrorCode::kWriteFailed, header.error().message);
  }
  impl->header = std::move(*header);
  impl->state.log_beside = true;
  impl->tail = {0, impl->header.chain_start};
  impl->writable = true;
  return SurgeryFile(std::move(impl));
}

Result<SurgeryFile> SurgeryFile::open(const fs::path& path) {
  return Impl::open(path, Access::kRead).map([](std::unique_ptr<Impl> impl) {
    return SurgeryFile(std::move(impl));
  });
}

Result<SurgeryFile> SurgeryFile::open_damaged(const fs::path& path) {
  return Impl::open(path, Access::kReadDamaged).map([](std::unique_ptr<Impl> impl) {
    return SurgeryFile(std::move(impl));
  });
}

Result<SurgeryFile> SurgeryFile::open_to_append(const fs::path& path) {
  // SQLite opens a file that it may not write for reading only, without a word.
  if (Status status = check_regular_file(path); !status) return tl::unexpected(status.error());
  if (::access(path.c_str(), W_OK) != 0) {
    return write_failed(path, std::string("cannot be written: ") + std::strerror(errno));
  }
  // What is no surgery is told before anything of it is touched.
  {
    auto readable = open(path);
    if (!readable) return tl::unexpected(readable.error());
    if (Status status = readable->close(); !status) return tl::unexpected(status.error());
  }
  auto opened = Impl::open(path, Access::kWrite);
  if (!opened) return tl::unexpected(opened.error());
  Impl& impl = **opened;
  const auto end = impl.walk([](const SurgeryRecord&) { return Status(); });
  if (!end) return tl::unexpected(end.error());
  if (Status ok = impl.check_end(*end); !ok) return tl::unexpected(ok.error());
  impl.tail = *end;
  if (Status ok = impl.database.use_log(); !ok) return tl::unexpected(ok.error());
  impl.writable = true;
  return SurgeryFile(std::move(*opened));
}

Status SurgeryFile::append(const SurgeryRecord& record) { return append({&record, 1}); }

Status SurgeryFile::append(std::span<const SurgeryRecord> records) {
  if (Status status = impl_->check_writable("record"); !status) return status;
  for (const SurgeryRecord& record : records) {
    if (fits(record.sequence)) continue;
    return invalid_file(impl_->database.path(),
                        fmt::format("record of sequence {}: must be below 2^63", record.sequence));
  }
  SqliteDatabase& database = impl_->database;
  if (!database.execute("BEGIN IMMEDIATE")) return database.write_failure("record");
  Impl::Tail end = impl_->tail;
  // Until the first record is added, a file that was closed stays so.
  Status status = impl_->state.closed ? remove_closed_seal(database) : Status();
  if (status) status = impl_->insert_records(records, end);
  if (status && !database.execute("COMMIT")) status = database.write_failure("record");
  if (status) {
    impl_->tail = end;
    impl_->state.records = end.records;
    impl_->state.closed = false;
    return {};
  }
  impl_->insert.reset();  // a failed statement is not reused
  // After some errors SQLite has rolled back by itself; then there is nothing left to undo.
  if (sqlite3_get_autocommit(database.handle()) == 0) database.execute("ROLLBACK");
  return status;
}

Status SurgeryFile::write_truth(std::uint64_t observation_sequence, const SurgeryTruth& truth) {
  if (Status status = impl_->check_writable("truth"); !status) return status;
  if (!fits(observation_sequence)) {
    return invalid_file(impl_->database.path(), "truth: sequence must be below 2^63");
  }
  return write_truth_rows(impl_->database, static_cast<std::int64_t>(observation_sequence), truth);
}

Status SurgeryFile::close() {
  SqliteDatabase& database = impl_->database;
  if (database.handle() == nullptr) return {};
  impl_->insert.reset();
  Status status;
  if (impl_->writable && !database.in_place()) {
    status = write_failed(database.path(), "was deleted, replaced or cut while it was written");
  } else if (impl_->writable) {
    const Impl::Tail& tail = impl_->tail;
    status = write_closed_seal(database, {tail.records, chain_end(tail.crc, tail.records)});
    if (status) status = database.fold_log();
    impl_->state.closed = status.has_value();
  }
  const Status closed = database.close();
  return status ? closed : status;
}

bool SurgeryFile::in_place() const { return impl_->database.in_place(); }
const fs::path& SurgeryFile::path() const { return impl_->database.path(); }
const SurgeryMeta& SurgeryFile::meta() const { return impl_->header.meta; }
const SurgeryState& SurgeryFile::state() const { return impl_->state; }

Status SurgeryFile::visit(const std::function<Status(const SurgeryRecord&)>& visitor) const {
  const SqliteDatabase& database = impl_->database;
  if (database.handle() == nullptr) return database.read_failure("records");
  // One moment for records and seal: another process may be writing.
  if (!database.execute("BEGIN")) return database.read_failure("records");
  const auto end = impl_->walk(visitor);
  Status status = end ? impl_->check_end(*end) : Status(tl::unexpected(end.error()));
  database.execute("COMMIT");
  return status;
}

Result<std::vector<SurgeryRecord>> SurgeryFile::records(RecordKind kind) const {
  std::vector<SurgeryRecord> records;
  const Status status = visit([&](const SurgeryRecord& record) {
    if (record.kind == kind) records.push_back(record);
    return Status();
  });
  if (!status) return tl::unexpected(status.error());
  return records;
}

Status SurgeryFile::newest_first(
    RecordKind kind, const std::function<Result<bool>(const SurgeryRecord&)>& visitor) const {
  const SqliteDatabase& database = impl_->database;
  if (database.handle() == nullptr) return database.read_failure("records");
  Statement select(database.handle(), kSelectNewest);
  select.bind_text(1, to_string(kind));
  while (select.row()) {
    const auto id = static_cast<std::uint64_t>(select.integer(0));
    const SurgeryRecord record{kind, static_cast<std::uint64_t>(select.integer(2)),
                               select.integer(3), select.bytes(4)};
    const auto before =
        id == 1 ? impl_->header.chain_start : static_cast<std::uint32_t>(select.integer(6));
    if (select.integer(5) != std::int64_t{chain_link(before, record)}) {
      return impl_->broken(id, "the checksum does not match; it, or the one before, was changed");
    }
    const auto more = visitor(record);
    if (!more) return tl::unexpected(more.error());
    if (!*more) return {};
  }
  return select.ok() ? Status() : Status(database.read_failure("records"));
}

Result<SurgeryTruth> SurgeryFile::read_truth(std::uint64_t observation_sequence) const {
  if (impl_->database.handle() == nullptr) return impl_->database.read_failure("truth");
  return read_truth_rows(impl_->database, static_cast<std::int64_t>(observation_sequence));
}

}  // namespace brainshift::io
