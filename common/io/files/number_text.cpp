// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/number_text.hpp"

#include <charconv>
#include <string_view>

namespace brainshift::io {
namespace {

constexpr std::string_view kBetween = " \t\r,;";
constexpr std::size_t kMaxQuoted = 32;

// Takes one line's numbers; the first word that is none, or "".
std::string_view take_numbers(std::string_view line, std::vector<double>& row) {
  for (std::size_t at = line.find_first_not_of(kBetween); at != std::string_view::npos;
       at = line.find_first_not_of(kBetween)) {
    line.remove_prefix(at);
    std::string_view word = line.substr(0, line.find_first_of(kBetween));
    line.remove_prefix(word.size());
    const std::string_view whole = word;
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
    double value = 0.0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || stop != word.data() + word.size())
      return whole.substr(0, kMaxQuoted);
    row.push_back(value);
  }
  return {};
}

}  // namespace

Result<std::vector<std::vector<double>>> parse_number_rows(const std::string& text) {
  std::vector<std::vector<double>> rows;
  std::string_view rest = text;
  for (int number = 1; !rest.empty(); ++number) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    const std::size_t first = line.find_first_not_of(kBetween);
    if (first == std::string_view::npos || line[first] == '#' || line.substr(first, 2) == "//")
      continue;
    rows.emplace_back();
    const std::string_view wrong = take_numbers(line, rows.back());
    if (wrong.empty()) continue;
    return fail(ErrorCode::kUnreadable,
                "line " + std::to_string(number) + ": \"" + std::string(wrong) + "\" is no number");
  }
  return rows;
}

}  // namespace brainshift::io
