// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/sqlite_database.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <system_error>

#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

constexpr int kBusyTimeoutMs = 500;
// Of one record: an update of the largest mesh, a field of truth.
constexpr int kMaxValueBytes = 256 << 20;

// Absolute: SQLite gives a meaning to names such as ":memory:". Escaped: '?', '#' and '%' have one
// in a URI.
std::string file_uri(const fs::path& path, bool immutable) {
  std::string uri = "file:";
  for (const char c : fs::absolute(path).string()) {
    const bool special = c == '?' || c == '#' || c == '%';
    if (!special) {
      uri.push_back(c);
      continue;
    }
    std::array<char, 4> escaped{};
    std::snprintf(escaped.data(), escaped.size(), "%%%02X", static_cast<unsigned char>(c));
    uri += escaped.data();
  }
  return immutable ? uri + "?immutable=1" : uri;
}

bool can_write_beside(const fs::path& path) {
  return ::access(fs::absolute(path).parent_path().c_str(), W_OK) == 0;
}

bool exists_beside(const fs::path& path, const char* suffix) {
  std::error_code ignored;
  return fs::exists(fs::path(path) += suffix, ignored);
}

}  // namespace

// Without close() SQLite folds the log as well as it can; nobody is left to be told of a failure.
SqliteDatabase::~SqliteDatabase() {
  // What lies at the path now belongs to somebody else: closing must not touch it.
  if (db_ && !in_place()) sqlite3_db_config(db_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  sqlite3_close_v2(db_);
}

Status SqliteDatabase::connect(Access access) {
  const bool writing = access == Access::kWrite;
  const bool immutable = !writing && !can_write_beside(path_) && !exists_beside(path_, "-wal") &&
                         !exists_beside(path_, "-journal");
  const int flags = SQLITE_OPEN_URI | (writing ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY);
  if (sqlite3_open_v2(file_uri(path_, immutable).c_str(), &db_, flags, nullptr) != SQLITE_OK) {
    return read_failure("surgery file");
  }
  sqlite3_extended_result_codes(db_, 1);
  sqlite3_busy_timeout(db_, kBusyTimeoutMs);
  // A file of a stranger runs nothing here: a view in the place of a table may never end.
  for (const int what : {SQLITE_DBCONFIG_ENABLE_VIEW, SQLITE_DBCONFIG_ENABLE_TRIGGER,
                         SQLITE_DBCONFIG_TRUSTED_SCHEMA}) {
    sqlite3_db_config(db_, what, 0, nullptr);
  }
  sqlite3_limit(db_, SQLITE_LIMIT_LENGTH, kMaxValueBytes);
  // With this SQLite accepts a file that is shorter than its header says.
  if (access == Access::kReadDamaged && !execute("PRAGMA writable_schema = ON")) {
    return read_failure("surgery file");
  }
  return {};
}

Status SqliteDatabase::close() {
  if (!in_place()) sqlite3_db_config(db_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  if (sqlite3_close(db_) != SQLITE_OK) return write_failure("surgery file");
  db_ = nullptr;
  written_.clear();
  return {};
}

bool SqliteDatabase::execute(const std::string& sql) const {
  return sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
}

std::optional<std::string> SqliteDatabase::query(const std::string& sql) const {
  Statement statement(db_, sql.c_str());
  if (!statement.row()) return std::nullopt;
  return statement.bytes(0);
}

Status SqliteDatabase::use_log() {
  if (query("PRAGMA journal_mode = WAL") != "wal" || !execute("PRAGMA synchronous = FULL") ||
      query("PRAGMA synchronous") != "2") {
    return write_failure("surgery file");
  }
  // Beginning to write makes the log, so that its loss can be noticed from now on.
  if (!execute("BEGIN IMMEDIATE") || !execute("COMMIT")) return write_failure("surgery file");
  written_.clear();
  for (const char* suffix : {"", "-wal", "-shm"}) {
    const fs::path path = fs::path(path_) += suffix;
    if (const auto id = id_of(path)) written_.emplace_back(path, *id);
  }
  return {};
}

Status SqliteDatabase::fold_log() {
  const auto busy = query("PRAGMA wal_checkpoint(TRUNCATE)");
  if (!busy) return write_failure("write-ahead log back");
  if (*busy != "0" || query("PRAGMA journal_mode = DELETE") != "delete") {
    return write_failed(path_, "cannot fold the write-ahead log back: the file is in use");
  }
  written_.clear();  // SQLite has removed the log
  return {};
}

bool SqliteDatabase::has_log() const {
  std::error_code ignored;
  const auto bytes = fs::file_size(log_path(), ignored);
  return !ignored && bytes > 0;
}

bool SqliteDatabase::in_place() const {
  if (db_ == nullptr) return true;
  int moved = 0;
  const int rc = sqlite3_file_control(db_, "main", SQLITE_FCNTL_HAS_MOVED, &moved);
  if (rc == SQLITE_OK && moved != 0) return false;
  for (auto& [path, id] : written_) {
    const auto now = id_of(path);
    if (!now || !id.is_still(*now)) return false;
    id = *now;
  }
  return true;
}

fs::path SqliteDatabase::log_path() const { return fs::path(path_) += "-wal"; }

std::optional<SqliteDatabase::FileId> SqliteDatabase::id_of(const fs::path& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) return std::nullopt;
  return FileId{found.st_dev, found.st_ino, found.st_size};
}

tl::unexpected<Error> SqliteDatabase::failure(ErrorCode code, std::string_view action,
                                              std::string_view what) const {
  return file_error(code, path_,
                    std::string(action) + " " + std::string(what) + ": " +
                        (db_ ? sqlite3_errmsg(db_) : "the file is closed"));
}

tl::unexpected<Error> SqliteDatabase::write_failure(std::string_view what) const {
  return failure(ErrorCode::kWriteFailed, "cannot write", what);
}

tl::unexpected<Error> SqliteDatabase::read_failure(std::string_view what) const {
  const int rc = db_ ? sqlite3_errcode(db_) : SQLITE_OK;
  if ((rc & 0xff) == SQLITE_CANTOPEN && has_log() && !can_write_beside(path_)) {
    return unreadable(
        "its folder cannot be written and its -wal file holds records; copy both to a folder that "
        "can be written");
  }
  return failure(ErrorCode::kUnreadable, "cannot read", what);
}

tl::unexpected<Error> SqliteDatabase::unreadable(const std::string& message) const {
  return file_error(ErrorCode::kUnreadable, path_, message);
}

}  // namespace brainshift::io
