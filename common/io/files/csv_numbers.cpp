// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/csv_numbers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "common/io/files/file_access.hpp"

namespace brainshift::io {

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return lower;
}

std::vector<std::pair<int, std::string>> content_lines(const std::string& text) {
  std::vector<std::pair<int, std::string>> lines;
  std::istringstream in(text);
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const std::string_view content = trimmed(line);
    if (!content.empty() && content.front() != '#') lines.emplace_back(number, content);
  }
  return lines;
}

tl::unexpected<Error> bad_line(int number, std::string_view line, std::string_view problem) {
  return unreadable(fmt::format("line {}: \"{}\" {}", number, line.substr(0, 60), problem));
}

std::optional<std::string_view> assigned_value(std::string_view line, std::string_view name) {
  if (!line.starts_with(name)) return std::nullopt;
  line = trimmed(line.substr(name.size()));
  if (!line.starts_with('=')) return std::nullopt;
  return trimmed(line.substr(1));
}

bool parse_number(std::string_view text, double& number) {
  text = trimmed(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(number);
}

std::vector<std::string_view> cells_of(std::string_view row) {
  std::vector<std::string_view> cells;
  for (std::size_t comma = row.find(','); comma != std::string_view::npos; comma = row.find(',')) {
    cells.push_back(trimmed(row.substr(0, comma)));
    row.remove_prefix(comma + 1);
  }
  cells.push_back(trimmed(row));
  return cells;
}

std::vector<std::string> quoted_cells_of(std::string_view row) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const bool mark = row[i] == '"';
    if (mark && quoted && i + 1 < row.size() && row[i + 1] == '"') {
      cells.back() += '"';
      ++i;
    } else if (mark) {
      quoted = !quoted;
    } else if (row[i] == ',' && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += row[i];
    }
  }
  for (std::string& cell : cells) cell = std::string(trimmed(cell));
  return cells;
}

bool has_number(const std::vector<std::string>& cells) {
  double number = 0.0;
  return std::any_of(cells.begin(), cells.end(),
                     [&](const std::string& cell) { return parse_number(cell, number); });
}

}  // namespace brainshift::io
