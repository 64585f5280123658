// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/landmarks/pair_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "MNI Tag Point File";

struct Columns {
  std::optional<std::size_t> name;
  std::array<std::size_t, 6> at{};
};

// Words between underscores: "x_src_mm" is {"x", "src", "mm"}.
std::set<std::string> words_of(const std::string& name) {
  std::set<std::string> words;
  std::istringstream stream(name);
  for (std::string word; std::getline(stream, word, '_');) words.insert(word);
  return words;
}

// None: the heading does not name all six columns, each once.
std::optional<Columns> columns_named(const std::vector<std::string>& heading) {
  static const std::array<std::set<std::string>, 2> kSides = {
      std::set<std::string>{"before", "src", "undeformed"},
      std::set<std::string>{"during", "dst", "deformed"}};
  static const std::array<const char*, 3> kAxes = {"x", "y", "z"};
  Columns columns;
  std::array<int, 6> found{};
  for (std::size_t column = 0; column < heading.size(); ++column) {
    const std::set<std::string> words = words_of(heading[column]);
    for (const char* name : {"label", "name", "row"}) {
      if (heading[column] == name && !columns.name) columns.name = column;
    }
    for (std::size_t place = 0; place < 6; ++place) {
      const auto& side = kSides[place / 3];
      const bool of_side = std::any_of(words.begin(), words.end(),
                                       [&](const auto& word) { return side.count(word) > 0; });
      if (!of_side || words.count(kAxes[place % 3]) == 0) continue;
      columns.at[place] = column;
      ++found[place];
    }
  }
  const bool each_once = std::all_of(found.begin(), found.end(), [](int n) { return n == 1; });
  return each_once ? std::optional(columns) : std::nullopt;
}

std::optional<Columns> columns_of_size(std::size_t cells) {
  if (cells != 6 && cells != 7) return std::nullopt;
  Columns columns;
  if (cells == 7) columns.name = 0;
  for (std::size_t place = 0; place < 6; ++place) columns.at[place] = place + cells - 6;
  return columns;
}

Result<NamedPairs> parse_csv(const std::string& content) {
  std::optional<Columns> columns;
  std::size_t expected = 0;
  NamedPairs pairs;
  for (const auto& [number, text] : content_lines(content)) {
    const auto cells = quoted_cells_of(text);
    const bool first = expected == 0;
    const bool heading = first && !has_number(cells);
    if (first) {
      expected = cells.size();
      columns = heading ? columns_named(cells) : std::nullopt;
      if (!columns) columns = columns_of_size(cells.size());
    }
    if (!columns) {
      return bad_line(number, text,
                      "must be 6 numbers (before x, y, z, during x, y, z), a name and 6 numbers, "
                      "or a heading with x_before, ..., z_during");
    }
    if (heading) continue;
    std::array<double, 6> values{};
    bool good = cells.size() == expected;
    for (std::size_t i = 0; good && i < 6; ++i) {
      good = parse_number(cells[columns->at[i]], values[i]);
    }
    if (!good) {
      return bad_line(number, text,
                      fmt::format("must have {} cells, six of them finite numbers", expected));
    }
    pairs.add(columns->name ? cells[*columns->name] : std::string(),
              Vec3(values[0], values[1], values[2]), Vec3(values[3], values[4], values[5]));
  }
  if (pairs.names.empty()) return fail(ErrorCode::kEmptySet, "holds no landmark");
  return pairs;
}

// One point of a .tag: numbers, then perhaps a name in quotation marks. False: something else.
bool parse_tag(std::string_view text, NamedPairs& pairs) {
  std::string name;
  if (const std::size_t quote = text.find('"'); quote != std::string_view::npos) {
    const std::size_t end = text.find('"', quote + 1);
    if (end == std::string_view::npos || !trimmed(text.substr(end + 1)).empty()) return false;
    name = text.substr(quote + 1, end - quote - 1);
    text = trimmed(text.substr(0, quote));
  }
  std::vector<double> numbers;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
    double number = 0.0;
    if (!parse_number(text.substr(0, end), number)) return false;
    numbers.push_back(number);
    text = trimmed(text.substr(end));
  }
  if (numbers.size() != 6 && numbers.size() != 9) return false;
  pairs.add(name, Vec3(numbers[0], numbers[1], numbers[2]),
            Vec3(numbers[3], numbers[4], numbers[5]));
  return true;
}

// The value of "NAME = VALUE", with or without the semicolon behind it.
std::optional<std::string_view> value_of(std::string_view line, std::string_view name) {
  auto value = assigned_value(line, name);
  if (value && value->ends_with(';')) value = trimmed(value->substr(0, value->size() - 1));
  return value;
}

Result<NamedPairs> parse_tag_file(const std::string& content) {
  std::istringstream lines(content);
  std::string line;
  NamedPairs pairs;
  enum class At { kStart, kHeader, kPoints, kEnd } at = At::kStart;
  bool two_volumes = false;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::string_view text = trimmed(line);
    if (text.empty() || text.front() == '%' || text.front() == '#') continue;
    const auto refuse = [&](const char* what) { return bad_line(number, text, what); };
    if (at == At::kStart) {
      if (text != kMagic) return unreadable("is no MNI tag point file");
      at = At::kHeader;
    } else if (at == At::kHeader) {
      if (const auto volumes = value_of(text, "Volumes")) {
        if (*volumes != "2") return refuse("must be 2: landmarks before and during surgery");
        two_volumes = true;
      } else if (const auto points = value_of(text, "Points"); points && points->empty()) {
        if (!two_volumes) return refuse("comes before \"Volumes = 2;\"");
        at = text.ends_with(';') ? At::kEnd : At::kPoints;
      } else {
        return refuse("is neither \"Volumes = 2;\" nor \"Points =\"");
      }
    } else if (at == At::kPoints) {
      const bool last = text.ends_with(';');
      if (last) text = trimmed(text.substr(0, text.size() - 1));
      if (!(last && text.empty()) && !parse_tag(text, pairs)) {
        return refuse("must be 6 or 9 finite numbers and perhaps a name in quotation marks");
      }
      if (last) at = At::kEnd;
    } else {
      return refuse("comes behind the last point");
    }
  }
  if (at == At::kStart) return unreadable("is no MNI tag point file");
  if (at != At::kEnd) return unreadable("is truncated: no \";\" ends its points");
  if (pairs.names.empty()) return fail(ErrorCode::kEmptySet, "holds no landmark");
  return pairs;
}

// ---- two lists by name ----

using Index = std::map<std::string, std::size_t>;

Result<Index> index_of(const NamedPoints& list, const char* what) {
  Index index;
  for (std::size_t i = 0; i < list.names.size(); ++i) {
    if (list.names[i].empty()) {
      return invalid(fmt::format("point {} of the {} list has no name", i + 1, what));
    }
    if (!index.emplace(list.names[i], i).second) {
      return invalid(fmt::format("the {} list has two points called \"{}\"", what, list.names[i]));
    }
  }
  return index;
}

}  // namespace

void NamedPairs::add(std::string name, const Vec3& one, const Vec3& other) {
  names.push_back(std::move(name));
  first.push_back(one);
  second.push_back(other);
}

Result<NamedPairs> pair_by_name(const NamedPoints& first, const NamedPoints& second) {
  const auto ones = index_of(first, "first"), others = index_of(second, "second");
  if (!ones) return tl::unexpected(ones.error());
  if (!others) return tl::unexpected(others.error());
  NamedPairs pairs;
  for (std::size_t i = 0; i < first.names.size(); ++i) {
    const std::string& name = first.names[i];
    const auto found = others->find(name);
    if (found == others->end()) {
      pairs.left_out.push_back(name);
    } else {
      pairs.add(name, first.points[i], second.points[found->second]);
    }
  }
  for (const std::string& name : second.names) {
    if (ones->count(name) == 0) pairs.left_out.push_back(name);
  }
  if (pairs.names.empty()) {
    return fail(ErrorCode::kEmptySet, fmt::format("no name is in both lists of {} and {} points",
                                                  first.names.size(), second.names.size()));
  }
  return pairs;
}

Result<NamedPairs> read_pairs(const fs::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".json" || extension == ".fcsv") {
    return unreadable(path,
                      "holds where the landmarks were at one time: a second file must say where "
                      "they were found during surgery");
  }
  if (extension != ".csv" && extension != ".tag") {
    return unreadable(path, "landmarks must be a .csv or .tag file");
  }
  return parse_file(path, [&](const std::string& content) {
    return extension == ".csv" ? parse_csv(content) : parse_tag_file(content);
  });
}

Result<NamedPairs> read_pairs(const fs::path& before, const fs::path& during) {
  const auto first = read_points(before);
  if (!first) return tl::unexpected(first.error());
  const auto second = read_points(during);
  if (!second) return tl::unexpected(second.error());
  auto pairs = pair_by_name(*first, *second);
  if (!pairs) {
    return file_error(pairs.error().code, before.string() + " and " + during.string(),
                      pairs.error().message);
  }
  return pairs;
}

}  // namespace brainshift::io
