// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/csv_numbers.hpp"

#include <charconv>
#include <cmath>

namespace brainshift::io {

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

bool parse_number(std::string_view text, double& number) {
  text = trimmed(text);
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

}  // namespace brainshift::io
