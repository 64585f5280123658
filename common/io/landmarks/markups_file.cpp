// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/landmarks/markups_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "common/io/files/csv_numbers.hpp"

namespace brainshift::io {
namespace {

using nlohmann::json;

constexpr std::string_view kSlicersColumns =
    "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID";

tl::unexpected<Error> unreadable_markups(const std::string& message) {
  return fail(ErrorCode::kUnreadable, message);
}

Result<Vec3> signs_to_ras(const std::string& system) {
  if (system == "RAS" || system == "0") return Vec3(1, 1, 1);
  if (system == "LPS" || system == "1") return Vec3(-1, -1, 1);
  if (system.empty()) {
    return unreadable_markups("coordinateSystem is missing: its points could be mirrored");
  }
  return unreadable_markups("coordinateSystem = " + system.substr(0, 30) + ": must be LPS or RAS");
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
  return unreadable_markups("coordinateUnits = " + units->dump().substr(0, 30) + ": must be mm");
}

Status take_point(const json& point, std::size_t number, const Vec3& signs, NamedPoints& list) {
  if (!point.is_object())
    return unreadable_markups(fmt::format("control point {} is no object", number));
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
    return unreadable_markups(
        fmt::format("control point {}: position must be three finite numbers", number));
  }
  list.add(text_of(point, "label"), signs.cwiseProduct(value));
  return {};
}

std::size_t column_of(const std::vector<std::string>& columns, const char* name) {
  return static_cast<std::size_t>(std::find(columns.begin(), columns.end(), name) -
                                  columns.begin());
}

// The value behind "NAME =" in a comment line, if it is one of that name.
std::optional<std::string> setting(std::string_view line, std::string_view name) {
  line.remove_prefix(1);  // '#'
  line = trimmed(line);
  if (!line.starts_with(name)) return std::nullopt;
  line = trimmed(line.substr(name.size()));
  if (!line.starts_with('=')) return std::nullopt;
  return std::string(trimmed(line.substr(1)));
}

}  // namespace

Result<NamedPoints> parse_markups_json(const std::string& content) {
  const json document = json::parse(content, nullptr, false);
  const auto list = document.is_object() ? document.find("markups") : document.end();
  if (!document.is_object() || list == document.end() || !list->is_array()) {
    return unreadable_markups("must be JSON with a list \"markups\"");
  }
  if (list->size() != 1 || !(*list)[0].is_object()) {
    return unreadable_markups(
        fmt::format("holds {} markups: must hold one point list", list->size()));
  }
  const json& markup = (*list)[0];
  if (const std::string type = text_of(markup, "type"); type != "Fiducial") {
    return unreadable_markups("type = " + type.substr(0, 30) + ": must be Fiducial, a point list");
  }
  const auto signs = signs_to_ras(text_of(markup, "coordinateSystem"));
  if (!signs) return tl::unexpected(signs.error());
  if (Status ok = check_units(markup); !ok) return tl::unexpected(ok.error());
  const auto points = markup.find("controlPoints");
  if (points == markup.end() || !points->is_array()) {
    return unreadable_markups("has no list \"controlPoints\"");
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
      if (const auto value = setting(text, "CoordinateSystem")) system = *value;
      if (const auto value = setting(text, "columns")) columns = quoted_cells_of(*value);
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
      return unreadable_markups(fmt::format(
          "line {}: \"{}\" must have finite numbers as x, y and z", number, text.substr(0, 60)));
    }
    named.add(cell("label"), signs->cwiseProduct(point));
  }
  if (named.names.empty()) return fail(ErrorCode::kEmptySet, "holds no point");
  return named;
}

}  // namespace brainshift::io
