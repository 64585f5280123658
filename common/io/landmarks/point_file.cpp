// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/landmarks/point_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <sstream>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/landmarks/markups_file.hpp"

namespace brainshift::io {
namespace {

// Where in a row the name and the coordinates are.
struct PointColumnsOf {
  std::optional<std::size_t> name;
  std::array<std::size_t, 3> at{};
  Vec3 signs = Vec3(1, 1, 1);  // to RAS
};

// None: the heading has no such columns.
std::optional<PointColumnsOf> point_columns_named(const std::vector<std::string>& heading) {
  struct Spelling {
    std::array<const char*, 3> names;
    Vec3 signs;
  };
  const std::array<Spelling, 3> spellings = {Spelling{{"x", "y", "z"}, Vec3(1, 1, 1)},
                                             Spelling{{"r", "a", "s"}, Vec3(1, 1, 1)},
                                             Spelling{{"l", "p", "s"}, Vec3(-1, -1, 1)}};
  const auto find = [&](const char* name) {
    return static_cast<std::size_t>(std::find(heading.begin(), heading.end(), name) -
                                    heading.begin());
  };
  PointColumnsOf columns;
  for (const char* name : {"label", "name"}) {
    if (find(name) < heading.size()) columns.name = find(name);
  }
  for (const Spelling& spelling : spellings) {
    for (std::size_t i = 0; i < 3; ++i) columns.at[i] = find(spelling.names[i]);
    columns.signs = spelling.signs;
    if (*std::max_element(columns.at.begin(), columns.at.end()) < heading.size()) return columns;
  }
  return std::nullopt;
}

// Of rows without a heading.
PointColumnsOf point_columns_of_size(std::size_t cells) {
  PointColumnsOf columns;
  const std::size_t first = cells == 4 ? 1 : 0;
  if (cells == 4) columns.name = 0;
  columns.at = {first, first + 1, first + 2};
  return columns;
}

Result<NamedPoints> parse_points(const std::string& content) {
  std::istringstream lines(content);
  std::string line;
  std::optional<PointColumnsOf> columns;
  std::size_t expected = 0;  // cells of a row; 0: a heading decides
  NamedPoints named;
  bool first = true;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::string_view text = trimmed(line);
    if (text.empty() || text.front() == '#') continue;
    const auto cells = quoted_cells_of(text);
    const bool heading = first && !has_number(cells);
    if (first && !heading && (cells.size() == 3 || cells.size() == 4)) {
      columns = point_columns_of_size(expected = cells.size());
    } else if (heading) {
      columns = point_columns_named(cells);
    }
    first = false;
    if (!columns) {
      return fail(ErrorCode::kUnreadable,
                  fmt::format("line {}: \"{}\" must be x,y,z or name,x,y,z, or a heading with the "
                              "columns x,y,z or r,a,s or l,p,s",
                              number, text.substr(0, 60)));
    }
    if (heading) continue;
    const auto cell = [&](std::size_t at) { return at < cells.size() ? cells[at] : std::string(); };
    Vec3 point;
    const bool numbers = parse_number(cell(columns->at[0]), point[0]) &&
                         parse_number(cell(columns->at[1]), point[1]) &&
                         parse_number(cell(columns->at[2]), point[2]);
    if (!numbers || (expected != 0 && cells.size() != expected)) {
      return fail(ErrorCode::kUnreadable,
                  fmt::format("line {}: \"{}\" must have three finite numbers{}", number,
                              text.substr(0, 60),
                              expected == 4 ? " behind a name, as the rows above" : ""));
    }
    named.add(columns->name ? cell(*columns->name) : std::string(),
              columns->signs.cwiseProduct(point));
  }
  if (named.names.empty()) return fail(ErrorCode::kEmptySet, "holds no point");
  return named;
}

}  // namespace

Result<NamedPoints> read_points(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension != ".json" && extension != ".fcsv" && extension != ".csv") {
    return file_error(ErrorCode::kUnreadable, path,
                      "points must be a .mrk.json, .fcsv or .csv file");
  }
  const auto content = read_file(path);
  if (!content) return tl::unexpected(content.error());
  auto named = extension == ".json"   ? parse_markups_json(*content)
               : extension == ".fcsv" ? parse_fcsv(*content)
                                      : parse_points(*content);
  if (!named) return file_error(named.error().code, path, named.error().message);
  return named;
}

}  // namespace brainshift::io
