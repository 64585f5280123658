// SPDX-License-Identifier: GPL-3.0-or-later
// The table that a study writes while it runs: all rows of one entry at once, so that an
// interrupted run keeps whole entries and a resumed one skips them.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::surgeries {

// Heading and cell, in the order of the columns.
using Row = std::vector<std::pair<std::string, std::string>>;

// Builds a row. Cells hold no commas, quotes or line breaks: semicolons stand for them.
class Cells {
 public:
  void add(const std::string& name, const std::string& text);
  void add(const std::string& name, double value);  // empty when not finite
  Row take() { return std::move(row_); }

 private:
  Row row_;
};
std::string cell_text(std::string text);
// "" where the row has no such column.
std::string text_of(const Row& row, const std::string& column);

class RowFile {
 public:
  using Key = std::vector<std::string>;
  // columns: a row with the headings; key: the columns that tell the entries apart. Starts an empty
  // table, or with `resume` goes on with one that is there. kUnreadable when that one has other
  // columns or ends within a row.
  static Result<RowFile> open(const std::filesystem::path& path, const Row& columns,
                              std::vector<std::string> key, bool resume);
  // In the order of the key's columns.
  bool has(const Key& key) const { return done_.count(key) > 0; }
  // All rows of one entry, by one write; an entry has at least one. kWriteFailed when somebody else
  // wrote to the file since, as a second run of the study would.
  Status append(const std::vector<Row>& rows);

 private:
  std::filesystem::path path_;
  std::vector<std::string> key_;
  std::set<Key> done_;
  std::uintmax_t bytes_ = 0;  // as this run left the file
};

}  // namespace brainshift::surgeries
