// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/table.hpp"

#include <algorithm>
#include <cctype>
#include <sstream>
#include <utility>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

constexpr std::string_view kTrue[] = {"1", "true", "yes", "defined"};
constexpr std::string_view kFalse[] = {"", "0", "false", "no", "undefined", "missing"};

Heading::Words words_of(const std::string& cell) {
  Heading::Words words;
  std::string word;
  for (const char c : lower_case(cell) + " ") {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      word += c;
    } else if (!word.empty()) {
      words.insert(std::exchange(word, {}));
    }
  }
  return words;
}

bool is_one_of(const std::string& cell, const auto& words) {
  return std::find(std::begin(words), std::end(words), lower_case(cell)) != std::end(words);
}

bool is_one_word(const std::string& cell) {
  return !cell.empty() && cell.find_first_of(" \t") == std::string::npos;
}

}  // namespace

std::optional<Vec3> PlaceColumns::of(const Cells& row) const {
  Vec3 place;
  for (std::size_t i = 0; i < 3; ++i) {
    if (at[i] >= row.size() || !parse_number(row[at[i]], place[static_cast<Eigen::Index>(i)])) {
      return std::nullopt;
    }
  }
  return signs.cwiseProduct(place);
}

Heading::Heading(const Cells& cells) {
  std::transform(cells.begin(), cells.end(), std::back_inserter(words_), words_of);
}

std::optional<std::size_t> Heading::column(const Words& names, const Words& also) const {
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < words_.size(); ++i) {
    std::size_t named = 0, known = 0;
    for (const std::string& word : words_[i]) {
      named += names.count(word);
      known += names.count(word) + also.count(word);
    }
    if (named != 1 || known != words_[i].size()) continue;
    if (found) return std::nullopt;
    found = i;
  }
  return found;
}

std::optional<std::size_t> Heading::name_column() const {
  for (const char* name : {"label", "name", "row"}) {
    if (const auto found = column({name})) return found;
  }
  return std::nullopt;
}

std::optional<PlaceColumns> Heading::place(const Words& sides, const Words& axes) const {
  std::optional<PlaceColumns> found;
  for (const std::string& triple : axes) {
    PlaceColumns place;
    std::size_t columns = 0;
    std::array<bool, 3> lps{};
    for (std::size_t i = 0; i < words_.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        Words rest = words_[i];
        if (rest.erase(std::string(1, triple[axis])) == 0) continue;
        bool of_side = sides.empty();
        for (const std::string& side : sides) of_side = rest.erase(side) > 0 || of_side;
        rest.erase("mm"), rest.erase("ras");
        const bool said = words_[i].count("lps") > 0;
        rest.erase("lps");
        if (!of_side || !rest.empty()) continue;
        place.at[axis] = i;
        lps[axis] = said || triple == "lps";
        ++columns;
      }
    }
    const bool distinct =
        place.at[0] != place.at[1] && place.at[1] != place.at[2] && place.at[2] != place.at[0];
    if (columns < 3) continue;
    if (columns > 3 || found || !distinct || lps[0] != lps[1] || lps[1] != lps[2]) {
      return std::nullopt;
    }
    if (lps[0]) place.signs = Vec3(-1, -1, 1);
    found = place;
  }
  return found;
}

Result<bool> Heading::placed(const Cells& row) const {
  bool all = true;
  for (std::size_t i = 0; i < words_.size(); ++i) {
    if (words_[i].count("defined") == 0 || i >= row.size()) continue;
    if (is_one_of(row[i], kFalse)) {
      all = false;
    } else if (!is_one_of(row[i], kTrue)) {
      return unreadable("has \"" + row[i].substr(0, 20) + "\" as defined: must be 1 or 0");
    }
  }
  return all;
}

Table parse_table(const std::string& content, bool comments_behind) {
  Table table;
  std::istringstream lines(content);
  std::string line;
  std::optional<TableRow> commented;  // the last line behind # in front of the rows
  bool first = true;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::string_view text = trimmed(line);
    if (text.empty()) continue;
    if (text.front() == '#') {
      text.remove_prefix(std::min(text.find_first_not_of("# \t"), text.size()));
      if (first && !text.empty()) {
        commented = TableRow{number, std::string(text), quoted_cells_of(text)};
      }
      continue;
    }
    if (comments_behind) text = trimmed(text.substr(0, text.find('#')));
    TableRow row{number, std::string(text), quoted_cells_of(text)};
    if (std::exchange(first, false)) {
      const bool heading = !has_number(row.cells);
      const bool above = !heading && commented && row.cells.size() > 1 &&
                         commented->cells.size() == row.cells.size() &&
                         !has_number(commented->cells) &&
                         std::all_of(commented->cells.begin(), commented->cells.end(), is_one_word);
      if (heading || above) {
        table.heading_row = heading ? row : *commented;
        table.heading = Heading(table.heading_row.cells);
      }
      if (heading) continue;
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace brainshift::io
