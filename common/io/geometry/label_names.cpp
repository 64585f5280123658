// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/label_names.hpp"

#include <algorithm>
#include <charconv>
#include <string_view>
#include <vector>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> between_tabs(std::string_view line) {
  std::vector<std::string> cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find('\t', begin), line.size());
    cells.emplace_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return cells;
}

Result<LabelNames> parse_names(const std::string& content) {
  LabelNames names;
  std::size_t index = 0, name = 0;
  int number = 0;
  bool headed = false;
  for (std::size_t begin = 0; begin < content.size();) {
    const std::size_t end = std::min(content.find('\n', begin), content.size());
    const std::string_view line = std::string_view(content).substr(begin, end - begin);
    begin = end + 1;
    ++number;
    if (trimmed(line).empty()) continue;
    const auto cells = between_tabs(line);
    const auto place = [&](const char* word) {
      return static_cast<std::size_t>(std::find(cells.begin(), cells.end(), word) - cells.begin());
    };
    if (!headed) {
      index = place("index"), name = place("name"), headed = true;
      if (std::max(index, name) < cells.size()) continue;
      return bad_line(number, line, "must be a heading with index and name, between tabs");
    }
    int label = 0;
    const std::string text = index < cells.size() ? cells[index] : "";
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), label);
    const bool whole = error == std::errc() && stop == text.data() + text.size();
    if (!whole || name >= cells.size() || cells[name].empty()) {
      return bad_line(number, line, "must have a whole number for index, and a name");
    }
    if (!names.emplace(label, cells[name]).second) {
      return bad_line(number, line, "names an index that an earlier line has");
    }
  }
  if (!headed) return unreadable("is empty: must have a heading with index and name");
  if (names.empty()) return unreadable("has no row below its heading, so no label has a name");
  return names;
}

}  // namespace

Result<LabelNames> read_label_names(const fs::path& path) {
  return parse_file(path, [](const std::string& content) { return parse_names(content); });
}

Result<LabelNames> label_names_beside(const fs::path& map) {
  fs::path table = map;
  if (lower_extension(table) == ".gz") table.replace_extension();
  table.replace_extension(".tsv");
  if (!fs::exists(table)) return LabelNames();
  return read_label_names(table);
}

}  // namespace brainshift::io
