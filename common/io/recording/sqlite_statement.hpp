// SPDX-License-Identifier: GPL-3.0-or-later
// RAII around one prepared SQLite statement. Private to the surgery file.
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace brainshift::io {

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
