// SPDX-License-Identifier: GPL-3.0-or-later
// RAII around one SQLite connection to one file, with errors that begin with the file's name, and
// around one prepared statement. Private to the surgery file.
#pragma once

#include <sqlite3.h>
#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::io {

class SqliteDatabase {
 public:
  enum class Access {
    kWrite,
    // Where the folder cannot be written and nothing lies beside the file, as on a read-only disk,
    // the file is taken as one that nobody changes: SQLite would otherwise need to write there.
    kRead,
    // As kRead, for a file of which a part is missing: what is there can be read.
    kReadDamaged,
  };

  explicit SqliteDatabase(std::filesystem::path path) : path_(std::move(path)) {}
  ~SqliteDatabase();
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  Status connect(Access access);
  // Ok also when it is closed already. Statements must be gone.
  Status close();

  const std::filesystem::path& path() const { return path_; }
  sqlite3* handle() const { return db_; }  // null when closed
  bool execute(const std::string& sql) const;
  // The first column of the only row; nullopt on failure.
  std::optional<std::string> query(const std::string& sql) const;

  // Synchronous FULL and a write-ahead log: what is committed survives power loss.
  Status use_log();
  // One file again. Needs every page in the main file and nobody else on it.
  Status fold_log();
  // A -wal file with content lies beside the file.
  bool has_log() const;
  // False when the file, its log or the log's index was deleted, moved, replaced or cut since it
  // was opened. SQLite maps the index into memory: using a part that was cut off ends the process.
  // So this is asked before every transaction.
  bool in_place() const;

  // "PATH: cannot write record: database or disk is full"
  tl::unexpected<Error> write_failure(std::string_view what) const;
  tl::unexpected<Error> read_failure(std::string_view what) const;
  tl::unexpected<Error> unreadable(const std::string& message) const;

 private:
  struct FileId {
    dev_t device = 0;
    ino_t inode = 0;
    std::int64_t bytes = 0;
    // What this is now may be longer.
    bool is_still(const FileId& now) const {
      return device == now.device && inode == now.inode && bytes <= now.bytes;
    }
  };
  static std::optional<FileId> id_of(const std::filesystem::path& path);
  std::filesystem::path log_path() const;
  tl::unexpected<Error> failure(ErrorCode code, std::string_view action,
                                std::string_view what) const;

  std::filesystem::path path_;
  sqlite3* db_ = nullptr;
  // Of file, write-ahead log and its index while this connection writes them; empty: it does not.
  mutable std::vector<std::pair<std::filesystem::path, FileId>> written_;
};

// A prepared statement. Binding and stepping remember the first failure; done() and row() report
// it.
class Statement {
 public:
  Statement(sqlite3* db, const char* sql) {
    rc_ = sqlite3_prepare_v2(db, sql, -1, &statement_, nullptr);
  }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;
  ~Statement() { sqlite3_finalize(statement_); }  // reports only what step() has reported already

  Statement& bind(int index, std::int64_t value) {
    return keep(rc_ == SQLITE_OK ? sqlite3_bind_int64(statement_, index, value) : rc_);
  }
  Statement& bind(int index, double value) {
    return keep(rc_ == SQLITE_OK ? sqlite3_bind_double(statement_, index, value) : rc_);
  }
  // The bytes must outlive the next step(). "" and not a null pointer: SQLite would store NULL.
  Statement& bind_text(int index, std::string_view text) {
    const char* data = text.empty() ? "" : text.data();
    return keep(rc_ == SQLITE_OK ? sqlite3_bind_text64(statement_, index, data, text.size(),
                                                       SQLITE_STATIC, SQLITE_UTF8)
                                 : rc_);
  }
  Statement& bind_blob(int index, const void* data, std::size_t size) {
    if (rc_ != SQLITE_OK) return *this;
    return keep(size == 0 ? sqlite3_bind_zeroblob(statement_, index, 0)
                          : sqlite3_bind_blob64(statement_, index, data, size, SQLITE_STATIC));
  }

  // True on a row; false at the end or on a failure: see ok().
  bool row() {
    if (rc_ != SQLITE_OK && rc_ != SQLITE_ROW) return false;
    rc_ = sqlite3_step(statement_);
    return rc_ == SQLITE_ROW;
  }
  bool ok() const { return rc_ == SQLITE_OK || rc_ == SQLITE_ROW || rc_ == SQLITE_DONE; }
  // Runs a statement that returns no rows, and makes it ready for the next.
  bool run() {
    while (row()) {
    }
    const bool succeeded = ok();
    if (succeeded) rc_ = sqlite3_reset(statement_);
    return succeeded;
  }

  std::int64_t integer(int column) const { return sqlite3_column_int64(statement_, column); }
  double real(int column) const { return sqlite3_column_double(statement_, column); }
  // Text or blob, as bytes; SQLite asks for the pointer before the size.
  std::string bytes(int column) const {
    const auto* data = static_cast<const char*>(sqlite3_column_blob(statement_, column));
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
    return data == nullptr ? std::string() : std::string(data, size);
  }

 private:
  Statement& keep(int rc) {
    rc_ = rc;
    return *this;
  }
  sqlite3_stmt* statement_ = nullptr;
  int rc_ = SQLITE_OK;
};

}  // namespace brainshift::io
