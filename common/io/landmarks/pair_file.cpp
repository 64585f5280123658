// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/landmarks/pair_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/table.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "MNI Tag Point File";

struct PairColumns {
  std::optional<std::size_t> name;
  PlaceColumns before, during;
};

// None: the heading does not name the six columns, each once.
std::optional<PairColumns> columns_named(const Heading& heading) {
  const auto before = heading.place({"before", "pre", "preop", "src", "source", "undeformed"});
  const auto during = heading.place(
      {"during", "after", "intra", "intraop", "post", "postop", "dst", "destination", "deformed"});
  if (!before || !during) return std::nullopt;
  return PairColumns{heading.name_column(), *before, *during};
}

std::optional<PairColumns> columns_of_size(std::size_t cells) {
  if (cells != 6 && cells != 7) return std::nullopt;
  PairColumns columns;
  if (cells == 7) columns.name = 0;
  const std::size_t first = cells - 6;
  columns.before.at = {first, first + 1, first + 2};
  columns.during.at = {first + 3, first + 4, first + 5};
  return columns;
}

Result<NamedPairs> parse_csv(const std::string& content) {
  const Table table = parse_table(content);
  if (table.rows.empty()) return fail(ErrorCode::kEmptySet, "holds no landmark");
  const TableRow& first = table.heading ? table.heading_row : table.rows.front();
  const auto columns =
      table.heading ? columns_named(*table.heading) : columns_of_size(first.cells.size());
  if (!columns) {
    return bad_line(first.line, first.text,
                    "must be 6 numbers (before x, y, z, during x, y, z), a name and 6 numbers, "
                    "or a heading with x_before, ..., z_during, each once");
  }
  NamedPairs pairs;
  for (const TableRow& row : table.rows) {
    const auto placed = table.heading ? table.heading->placed(row.cells) : Result<bool>(true);
    if (!placed) return bad_line(row.line, row.text, placed.error().message);
    if (!*placed) continue;
    const auto before = columns->before.of(row.cells), during = columns->during.of(row.cells);
    if (!before || !during || row.cells.size() != first.cells.size()) {
      return bad_line(
          row.line, row.text,
          fmt::format("must have {} cells, six of them finite numbers", first.cells.size()));
    }
    pairs.add(columns->name ? row.cells[*columns->name] : std::string(), *before, *during);
  }
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

// Without what follows a % or # that is not in a name.
std::string_view without_comment(std::string_view text) {
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') quoted = !quoted;
    if (!quoted && (text[i] == '%' || text[i] == '#')) return trimmed(text.substr(0, i));
  }
  return text;
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
    std::string_view text = without_comment(trimmed(line));
    if (text.empty()) continue;
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
      // Where a comment stands behind the last point, the semicolon stands behind the comment.
      const bool last = text.ends_with(';') || trimmed(line).ends_with(';');
      if (text.ends_with(';')) text = trimmed(text.substr(0, text.size() - 1));
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
  return pairs;
}

// A pair that a file has twice would count twice.
Result<NamedPairs> checked_pairs(NamedPairs pairs) {
  if (pairs.names.empty()) return fail(ErrorCode::kEmptySet, "holds no landmark");
  for (std::size_t i = 0; i < pairs.names.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (pairs.first[i] != pairs.first[k] || pairs.second[i] != pairs.second[k]) continue;
      return unreadable(fmt::format("landmarks {} and {} are the same pair, \"{}\"", k + 1, i + 1,
                                    pairs.names[i]));
    }
  }
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
  const std::string extension = lower_extension(path);
  if (extension == ".json" || extension == ".fcsv") {
    return unreadable(path,
                      "holds where the landmarks were at one time: a second file must say where "
                      "they were found during surgery");
  }
  if (extension != ".csv" && extension != ".tag") {
    return unreadable(path, "landmarks must be a .csv or .tag file");
  }
  return parse_file(path, [&](const std::string& content) {
    return (extension == ".csv" ? parse_csv(content) : parse_tag_file(content))
        .and_then(checked_pairs);
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
