// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/landmarks/point_file.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <optional>
#include <sstream>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/table.hpp"

namespace brainshift::io {
namespace {

using nlohmann::json;

// ---- 3D Slicer's point lists ----

constexpr std::string_view kSlicersColumns =
    "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID";
constexpr std::size_t kSlicersColumnCount = 14;

Result<Vec3> signs_to_ras(const std::string& said) {
  const std::string system = lower_case(said);
  if (system == "ras" || system == "0") return Vec3(1, 1, 1);
  if (system == "lps" || system == "1") return Vec3(-1, -1, 1);
  if (system.empty()) {
    return unreadable("coordinateSystem is missing: its points could be mirrored");
  }
  return unreadable("coordinateSystem = " + said.substr(0, 30) + ": must be LPS or RAS");
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

// Slicer 5 writes two columns more than it names: the state of the position (2: it was placed) and
// whether the point was made by a program.
bool was_placed(const Heading& columns, const Cells& cells) {
  const auto named = columns.column({"positionstatus"});
  const std::size_t at = named.value_or(kSlicersColumnCount);
  if (!named && columns.size() != kSlicersColumnCount) return true;
  return at >= cells.size() || cells[at].empty() || cells[at] == "2" || cells[at] == "defined";
}

Result<NamedPoints> parse_fcsv(const std::string& content) {
  std::istringstream lines(content);
  std::string line, system;
  Heading columns(quoted_cells_of(kSlicersColumns));
  NamedPoints named;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::string_view text = trimmed(line);
    if (text.empty()) continue;
    if (text.front() == '#') {
      const std::string_view comment = trimmed(text.substr(1));
      if (const auto value = assigned_value(comment, "CoordinateSystem")) system = *value;
      if (const auto value = assigned_value(comment, "columns")) {
        columns = Heading(quoted_cells_of(*value));
        if (!columns.place({}, {"xyz"})) {
          return bad_line(number, text, "must name columns x, y and z, each once");
        }
      }
      continue;
    }
    const auto signs = signs_to_ras(system);
    if (!signs) return tl::unexpected(signs.error());
    const auto cells = quoted_cells_of(text);
    if (!was_placed(columns, cells)) continue;
    const auto point = columns.place({}, {"xyz"})->of(cells);
    if (!point) return bad_line(number, text, "must have finite numbers as x, y and z");
    const auto label = columns.column({"label"});
    named.add(label && *label < cells.size() ? cells[*label] : std::string(),
              signs->cwiseProduct(*point));
  }
  if (named.names.empty()) return fail(ErrorCode::kEmptySet, "holds no point that was placed");
  return named;
}

// ---- tables ----

Result<NamedPoints> parse_points(const std::string& content) {
  const Table table = parse_table(content);
  if (table.rows.empty()) return fail(ErrorCode::kEmptySet, "holds no point");
  // Without a heading: x,y,z or name,x,y,z, as the first row has it.
  const std::size_t expected = table.heading ? 0 : table.rows.front().cells.size();
  const std::size_t first = expected == 4 ? 1 : 0;
  std::optional<PlaceColumns> columns = PlaceColumns{{first, first + 1, first + 2}};
  std::optional<std::size_t> name;
  if (expected == 4) name = 0;
  if (table.heading) {
    columns = table.heading->place();
    name = table.heading->name_column();
  } else if (expected != 3 && expected != 4) {
    columns.reset();
  }
  if (!columns) {
    const TableRow& row = table.heading ? table.heading_row : table.rows.front();
    return bad_line(row.line, row.text,
                    "must be x,y,z or name,x,y,z, or a heading with the columns x,y,z or r,a,s or "
                    "l,p,s, each once");
  }
  NamedPoints named;
  for (const TableRow& row : table.rows) {
    const auto placed = table.heading ? table.heading->placed(row.cells) : Result<bool>(true);
    if (!placed) return bad_line(row.line, row.text, placed.error().message);
    if (!*placed) continue;
    const auto point = columns->of(row.cells);
    const std::size_t most = table.heading ? table.heading->size() : expected;
    if (!point || row.cells.size() > most || row.cells.size() < expected) {
      return bad_line(row.line, row.text,
                      table.heading ? "must have three finite numbers, and no more cells than the "
                                      "heading"
                      : expected == 4 ? "must have three finite numbers behind a name"
                                      : "must have three finite numbers and nothing else");
    }
    named.add(name && *name < row.cells.size() ? row.cells[*name] : std::string(), *point);
  }
  if (named.names.empty()) return fail(ErrorCode::kEmptySet, "holds no point that was placed");
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
  const std::string extension = lower_extension(path);
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
