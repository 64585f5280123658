// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of comma-separated values, which benchmarks write and figures and checks are made from.
// Cells hold no commas, quotes or line breaks. An empty cell is a value that does not apply.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::bench {

class CsvTable {
 public:
  // kUnreadable when a row has another number of cells than the
  // heading; the sentence begins with `origin`.
  static Result<CsvTable> parse(std::string_view text, const std::string& origin);
  static Result<CsvTable> read(const std::filesystem::path& path);  // kNotFound, kUnreadable

  std::size_t rows() const { return cells_.size(); }
  bool has(std::string_view column) const;
  // Empty where the table has no such column.
  const std::string& text(std::size_t row, std::string_view column) const;
  // NaN where the cell is empty or no number.
  double number(std::size_t row, std::string_view column) const;

 private:
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> cells_;
};

// One line per row(), on disk at once, so that an interrupted run keeps what it measured.
class CsvWriter {
 public:
  static Result<CsvWriter> create(const std::filesystem::path& path, std::string_view heading);
  Status row(const std::vector<std::string>& cells);

 private:
  std::filesystem::path path_;
  std::ofstream file_;
};

// Shortest text that reads back as the number rounded to `digits`
// significant digits; empty for a number that is not finite.
std::string csv_number(double value, int digits = 6);

}  // namespace brainshift::bench
