// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/csv_table.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>

namespace brainshift::bench {
namespace {

std::vector<std::string> split(std::string_view line) {
  std::vector<std::string> cells;
  for (;;) {
    const std::size_t comma = line.find(',');
    cells.emplace_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

}  // namespace

Result<CsvTable> CsvTable::parse(std::string_view text, const std::string& origin) {
  CsvTable table;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line.empty()) continue;
    std::vector<std::string> cells = split(line);
    if (table.columns_.empty()) {
      table.columns_ = std::move(cells);
      continue;
    }
    if (cells.size() != table.columns_.size()) {
      return fail(ErrorCode::kUnreadable, origin + ": line " + std::to_string(line_number) +
                                              " has " + std::to_string(cells.size()) +
                                              " cells, the heading has " +
                                              std::to_string(table.columns_.size()));
    }
    table.cells_.push_back(std::move(cells));
  }
  if (table.columns_.empty()) return fail(ErrorCode::kUnreadable, origin + ": has no heading");
  return table;
}

Result<CsvTable> CsvTable::read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return fail(ErrorCode::kNotFound, path.string() + ": cannot be opened");
  std::ostringstream text;
  text << file.rdbuf();
  return parse(text.str(), path.string());
}

bool CsvTable::has(std::string_view column) const {
  return std::find(columns_.begin(), columns_.end(), column) != columns_.end();
}

const std::string& CsvTable::text(std::size_t row, std::string_view column) const {
  static const std::string none;
  const auto found = std::find(columns_.begin(), columns_.end(), column);
  if (found == columns_.end()) return none;
  return cells_.at(row)[static_cast<std::size_t>(found - columns_.begin())];
}

double CsvTable::number(std::size_t row, std::string_view column) const {
  const std::string& cell = text(row, column);
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  const bool whole = error == std::errc() && end == cell.data() + cell.size();
  return whole ? value : std::numeric_limits<double>::quiet_NaN();
}

Result<CsvWriter> CsvWriter::create(const std::filesystem::path& path, std::string_view heading) {
  CsvWriter writer;
  writer.path_ = path;
  writer.file_.open(path, std::ios::trunc);
  writer.file_ << heading << '\n' << std::flush;
  if (!writer.file_) return fail(ErrorCode::kWriteFailed, path.string() + ": cannot be written");
  return writer;
}

Status CsvWriter::row(const std::vector<std::string>& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) file_ << (i == 0 ? "" : ",") << cells[i];
  file_ << '\n' << std::flush;
  if (!file_) return fail(ErrorCode::kWriteFailed, path_.string() + ": cannot be written");
  return {};
}

std::string csv_number(double value, int digits) {
  if (!std::isfinite(value)) return {};
  std::array<char, 64> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value,
                                          std::chars_format::general, digits);
  return error == std::errc() ? std::string(text.data(), end) : std::string();
}

}  // namespace brainshift::bench
