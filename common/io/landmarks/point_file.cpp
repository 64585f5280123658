// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/landmarks/point_file.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <optional>
#include <sstream>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

using nlohmann::json;

// ---- 3D Slicer's point lists ----

constexpr std::string_view kSlicersColumns =
    "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID";

Result<Vec3> signs_to_ras(const std::string& system) {
  if (system == "RAS" || system == "0") return Vec3(1, 1, 1);
  if (system == "LPS" || system == "1") return Vec3(-1, -1, 1);
  if (system.empty()) {
    return unreadable("coordinateSystem is missing: its points could be mirrored");
  }
  return unreadable("coordinateSystem = " + system.substr(0, 30) + ": must be LPS or RAS");
}

// A text, or the text of a number; empty for anything else.
std::string text_of(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return {};
  if (found->is_string()) return found->get<std::string>();
  return found->is_number() ? found->dump() : std::string("(no text)");
}

Status check_units(const json& markup) {
  const auto units = markup.find("coordinateUnits");
  if (units == markup.end()) return {};
  const auto is_mm = [](const json& unit) { return unit == "mm"; };
  const bool good =
      units->is_array() ? std::all_of(units->begin(), units->end(), is_mm) : is_mm(*units);
  if (good) return {};
  return unreadable("coordinateUnits = " + units->dump().substr(0, 30) + ": must be mm");
}

Status take_point(const json& point, std::size_t number, const Vec3& signs, NamedPoints& list) {
  if (!point.is_object()) return unreadable(fmt::format("control point {} is no object", number));
  const std::string status = text_of(point, "positionStatus");
  if (!status.empty() && status != "defined") return {};
  const auto position = point.find("position");
  const bool three = position != point.end() && position->is_array() && position->size() == 3;
  Vec3 value;
  for (std::size_t i = 0; three && i < 3; ++i) {
    const json& number_at = (*position)[i];
    value[static_cast<Eigen::Index>(i)] =
        number_at.is_number() ? number_at.get<double>() : std::nan("");
  }
  if (!three || !value.allFinite()) {
    return unreadable(
        fmt::format("control point {}: position must be three finite numbers", number));
  }
  list.add(text_of(point, "label"), signs.cwiseProduct(value));
  return {};
}

std::size_t column_of(const std::vector<std::string>& columns, const char* name) {
  return static_cast<std::size_t>(std::find(columns.begin(), columns.end(), name) -
                                  columns.begin());
}

Result<NamedPoints> parse_markups_json(const std::string& content) {
  const json document = json::parse(content, nullptr, false);
  const auto list = document.is_object() ? document.find("markups") : document.end();
  if (!document.is_object() || list == document.end() || !list->is_array()) {
    return unreadable("must be JSON with a list \"markups\"");
  }
  if (list->size() != 1 || !(*list)[0].is_object()) {
    return unreadable(fmt::format("holds {} markups: must hold one point list", list->size()));
  }
  const json& markup = (*list)[0];
  if (const std::string type = text_of(markup, "type"); type != "Fiducial") {
    return unreadable("type = " + type.substr(0, 30) + ": must be Fiducial, a point list");
  }
  const auto signs = signs_to_ras(text_of(markup, "coordinateSystem"));
  if (!signs) return tl::unexpected(signs.error());
  if (Status ok = check_units(markup); !ok) return tl::unexpected(ok.error());
  const auto points = markup.find("controlPoints");
  if (points == markup.end() || !points->is_array()) {
    return unreadable("has no list \"controlPoints\"");
  }
  NamedPoints named;
  std::size_t number = 0;
  for (const json& point : *points) {
    if (Status ok = take_point(point, ++number, *signs, named); !ok) {
      return tl::unexpected(ok.error());
    }
  }
  if (named.names.empty()) return fail(ErrorCode::kEmptySet, "holds no point that was placed");
  return named;
}

Result<NamedPoints> parse_fcsv(const std::string& content) {
  std::istringstream lines(content);
  std::string line, system;
  std::vector<std::string> columns = quoted_cells_of(kSlicersColumns);
  NamedPoints named;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::string_view text = trimmed(line);
    if (text.empty()) continue;
    if (text.front() == '#') {
      const std::string_view comment = trimmed(text.substr(1));
      if (const auto value = assigned_value(comment, "CoordinateSystem")) system = *value;
      if (const auto value = assigned_value(comment, "columns")) columns = quoted_cells_of(*value);
      continue;
    }
    const auto signs = signs_to_ras(system);
    if (!signs) return tl::unexpected(signs.error());
    const auto cells = quoted_cells_of(text);
    const auto cell = [&](const char* name) {
      const std::size_t at = column_of(columns, name);
      return at < cells.size() && at < columns.size() ? cells[at] : std::string();
    };
    Vec3 point;
    if (!parse_number(cell("x"), point[0]) || !parse_number(cell("y"), point[1]) ||
        !parse_number(cell("z"), point[2])) {
      return bad_line(number, text, "must have finite numbers as x, y and z");
    }
    named.add(cell("label"), signs->cwiseProduct(point));
  }
  if (named.names.empty()) return fail(ErrorCode::kEmptySet, "holds no point");
  return named;
}

// ---- tables ----

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
  std::optional<PointColumnsOf> columns;
  std::size_t expected = 0;  // cells of a row; 0: a heading decides
  NamedPoints named;
  bool first = true;
  for (const auto& [number, text] : content_lines(content)) {
    const auto cells = quoted_cells_of(text);
    const bool heading = first && !has_number(cells);
    if (first && !heading && (cells.size() == 3 || cells.size() == 4)) {
      columns = point_columns_of_size(expected = cells.size());
    } else if (heading) {
      columns = point_columns_named(cells);
    }
    first = false;
    if (!columns) {
      return bad_line(number, text,
                      "must be x,y,z or name,x,y,z, or a heading with the columns x,y,z or r,a,s "
                      "or l,p,s");
    }
    if (heading) continue;
    const auto cell = [&](std::size_t at) { return at < cells.size() ? cells[at] : std::string(); };
    Vec3 point;
    const bool numbers = parse_number(cell(columns->at[0]), point[0]) &&
                         parse_number(cell(columns->at[1]), point[1]) &&
                         parse_number(cell(columns->at[2]), point[2]);
    if (!numbers || (expected != 0 && cells.size() != expected)) {
      return bad_line(number, text,
                      expected == 4
                          ? "must have three finite numbers behind a name, as the rows above"
                          : "must have three finite numbers");
    }
    named.add(columns->name ? cell(*columns->name) : std::string(),
              columns->signs.cwiseProduct(point));
  }
  if (named.names.empty()) return fail(ErrorCode::kEmptySet, "holds no point");
  return named;
}

}  // namespace

void NamedPoints::add(std::string name, const Vec3& point) {
  names.push_back(std::move(name));
  points.push_back(point);
}

bool NamedPoints::all_named() const {
  return std::none_of(names.begin(), names.end(), [](const auto& name) { return name.empty(); });
}

Result<NamedPoints> read_points(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension != ".json" && extension != ".fcsv" && extension != ".csv") {
    return unreadable(path, "points must be a .mrk.json, .fcsv or .csv file");
  }
  return parse_file(path, [&](const std::string& content) {
    return extension == ".json"   ? parse_markups_json(content)
           : extension == ".fcsv" ? parse_fcsv(content)
                                  : parse_points(content);
  });
}

}  // namespace brainshift::io
