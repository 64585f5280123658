// SPDX-License-Identifier: GPL-3.0-or-later
// RAII around one SQLite connection to one file, with errors that begin with the file's name.
// Private to the surgery file.
#pragma once

#include <sqlite3.h>
#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

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
  // False when the file, or its log, was deleted, moved or replaced since it was opened.
  bool in_place() const;

  // "PATH: cannot write record: database or disk is full"
  tl::unexpected<Error> write_failure(std::string_view what) const;
  tl::unexpected<Error> read_failure(std::string_view what) const;
  tl::unexpected<Error> unreadable(const std::string& message) const;

 private:
  struct FileId {
    dev_t device = 0;
    ino_t inode = 0;
    bool operator==(const FileId&) const = default;
  };
  static std::optional<FileId> id_of(const std::filesystem::path& path);
  std::filesystem::path log_path() const;
  tl::unexpected<Error> failure(ErrorCode code, std::string_view action,
                                std::string_view what) const;

  std::filesystem::path path_;
  sqlite3* db_ = nullptr;
  std::optional<FileId> log_id_;  // of the write-ahead log while this connection writes it
};

}  // namespace brainshift::io
