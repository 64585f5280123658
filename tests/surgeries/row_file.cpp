// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/row_file.hpp"

#include <algorithm>
#include <fstream>

#include "tests/benchmarks/csv_table.hpp"

namespace brainshift::surgeries {
namespace {

std::string line_of(const Row& row, bool heading) {
  std::string line;
  for (const auto& [name, text] : row) line += (heading ? name : text) + ",";
  line.back() = '\n';
  return line;
}

}  // namespace

std::string cell_text(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == ',' || c == '"' || c == '\n'; }, ';');
  return text;
}

void Cells::add(const std::string& name, const std::string& text) {
  row_.emplace_back(name, cell_text(text));
}

void Cells::add(const std::string& name, double value) {
  row_.emplace_back(name, bench::csv_number(value));
}

std::string text_of(const Row& row, const std::string& column) {
  for (const auto& [name, text] : row) {
    if (name == column) return text;
  }
  return "";
}

Result<RowFile> RowFile::open(const std::filesystem::path& path, const Row& columns,
                              std::vector<std::string> key, bool resume) {
  RowFile file;
  file.path_ = path;
  file.key_ = std::move(key);
  const std::string heading = line_of(columns, true);
  if (resume && std::filesystem::exists(path)) {
    const auto table = bench::CsvTable::read(path);
    if (!table) return tl::unexpected(table.error());
    std::ifstream stream(path);
    std::string first;
    std::getline(stream, first);
    if (first + "\n" != heading) {
      return fail(ErrorCode::kUnreadable,
                  path.string() + ": its columns are those of another version");
    }
    for (std::size_t row = 0; row < table->rows(); ++row) {
      Key done;
      for (const std::string& column : file.key_) done.push_back(table->text(row, column));
      file.done_.insert(done);
    }
    file.bytes_ = std::filesystem::file_size(path);
    return file;
  }
  std::ofstream stream(path, std::ios::trunc);
  stream << heading << std::flush;
  if (!stream) return fail(ErrorCode::kWriteFailed, path.string() + ": cannot be written");
  file.bytes_ = heading.size();
  return file;
}

Status RowFile::append(const std::vector<Row>& rows) {
  std::string text;
  for (const Row& row : rows) text += line_of(row, false);
  std::error_code missing;
  if (std::filesystem::file_size(path_, missing) != bytes_) {
    return fail(ErrorCode::kWriteFailed,
                path_.string() + ": another run writes to it, or it was removed");
  }
  std::ofstream stream(path_, std::ios::app);
  stream << text << std::flush;
  if (!stream) return fail(ErrorCode::kWriteFailed, path_.string() + ": cannot be written");
  bytes_ += text.size();
  Key done;
  for (const std::string& column : key_) done.push_back(text_of(rows.front(), column));
  done_.insert(done);
  return {};
}

}  // namespace brainshift::surgeries
