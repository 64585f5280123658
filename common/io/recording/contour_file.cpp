// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/contour_file.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/table.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kMaxFrames = 1'000'000;

struct Row {
  int line = 0;
  int frame = 0;
  Eigen::Vector2d at_px = Eigen::Vector2d::Zero();
};

using RowColumns = std::array<std::size_t, 3>;  // frame, u, v

std::optional<RowColumns> pixel_columns(const Heading& heading) {
  const Heading::Words pixels = {"px", "pixel", "pixels"};
  const auto frame = heading.column({"frame", "image"}, {"number", "index"});
  const auto u = heading.column({"u", "x"}, pixels), v = heading.column({"v", "y"}, pixels);
  if (!frame || !u || !v) return std::nullopt;
  return RowColumns{*frame, *u, *v};
}

bool parse_row(const Cells& cells, const RowColumns& columns, Row& row) {
  double numbers[3];
  for (std::size_t i = 0; i < 3; ++i) {
    if (columns[i] >= cells.size() || !parse_number(cells[columns[i]], numbers[i])) return false;
  }
  const double frame = numbers[0];
  if (frame < 0.0 || frame > kMaxFrames || frame != std::floor(frame)) return false;
  row.frame = static_cast<int>(frame);
  row.at_px = {numbers[1], numbers[2]};
  return true;
}

Result<std::vector<Row>> read_rows(const std::string& content) {
  const Table table = parse_table(content, true);
  std::optional<RowColumns> columns = RowColumns{0, 1, 2};
  if (table.heading) columns = pixel_columns(*table.heading);
  if (!columns) {
    return bad_line(table.heading_row.line, table.heading_row.text,
                    "must name the columns frame, u_px and v_px, each once");
  }
  std::vector<Row> rows;
  for (const TableRow& cells : table.rows) {
    Row row;
    row.line = cells.line;
    const std::size_t size = table.heading ? table.heading->size() : 3;
    if (cells.cells.size() != size || !parse_row(cells.cells, *columns, row)) {
      return bad_line(cells.line, cells.text, "must be frame,u_px,v_px with a frame from 0");
    }
    rows.push_back(row);
  }
  if (rows.empty()) return fail(ErrorCode::kEmptySet, "holds no row frame,u_px,v_px");
  return rows;
}

Result<std::vector<ultrasound::Contour>> contours_of_rows(const std::vector<Row>& rows,
                                                          bool closed) {
  std::vector<ultrasound::Contour> contours;
  std::set<int> finished;
  for (std::size_t first = 0; first < rows.size();) {
    std::size_t end = first;
    while (end < rows.size() && rows[end].frame == rows[first].frame) ++end;
    if (!finished.insert(rows[first].frame).second) {
      return unreadable(fmt::format("line {}: frame {} comes a second time", rows[first].line,
                                    rows[first].frame));
    }
    ultrasound::Contour contour;
    contour.frame = rows[first].frame;
    contour.closed = closed;
    contour.points_px.resize(2, static_cast<Eigen::Index>(end - first));
    for (std::size_t i = first; i < end; ++i) {
      contour.points_px.col(static_cast<Eigen::Index>(i - first)) = rows[i].at_px;
    }
    contours.push_back(std::move(contour));
    first = end;
  }
  return contours;
}

// What is wrong with one entry of "contours", or nothing.
std::string read_entry(const json& entry, ultrasound::Contour& contour) {
  if (!entry.is_object()) return "is no object";
  for (const auto& [key, value] : entry.items()) {
    if (key != "frame" && key != "closed" && key != "points_px")
      return "key " + key + " is unknown";
  }
  const auto frame = entry.find("frame");
  if (frame == entry.end() || !frame->is_number_unsigned() || *frame > kMaxFrames) {
    return "frame must be a whole number from 0";
  }
  contour.frame = frame->get<int>();
  const auto closed = entry.find("closed");
  if (closed != entry.end() && !closed->is_boolean()) return "closed must be true or false";
  contour.closed = closed == entry.end() || closed->get<bool>();
  const auto points = entry.find("points_px");
  if (points == entry.end() || !points->is_array()) return "points_px must be a list of [u, v]";
  contour.points_px.resize(2, static_cast<Eigen::Index>(points->size()));
  for (std::size_t i = 0; i < points->size(); ++i) {
    const json& point = (*points)[i];
    if (!point.is_array() || point.size() != 2 || !point[0].is_number() || !point[1].is_number()) {
      return fmt::format("points_px[{}] must be [u, v]", i);
    }
    contour.points_px.col(static_cast<Eigen::Index>(i)) << point[0].get<double>(),
        point[1].get<double>();
  }
  return {};
}

Result<std::vector<ultrasound::Contour>> contours_of_json(const std::string& content) {
  const json document = json::parse(content, nullptr, false);
  const auto list = document.is_object() ? document.find("contours") : document.end();
  if (!document.is_object() || list == document.end() || !list->is_array()) {
    return unreadable("must be JSON with a list \"contours\"");
  }
  std::vector<ultrasound::Contour> contours;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ultrasound::Contour contour;
    const std::string problem = read_entry((*list)[i], contour);
    if (!problem.empty()) return unreadable(fmt::format("contours[{}]: {}", i, problem));
    contours.push_back(std::move(contour));
  }
  if (contours.empty()) return fail(ErrorCode::kEmptySet, "holds no contour");
  return contours;
}

}  // namespace

Result<std::vector<ultrasound::Contour>> read_contours(const fs::path& path, bool closed) {
  using Contours = std::vector<ultrasound::Contour>;
  return parse_file(path, [&](const std::string& content) -> Result<Contours> {
    if (lower_extension(path) == ".json") return contours_of_json(content);
    if (lower_extension(path) != ".csv") return unreadable("contours must be a .csv or .json file");
    return read_rows(content).and_then(
        [&](const std::vector<Row>& rows) { return contours_of_rows(rows, closed); });
  });
}

Result<std::vector<ultrasound::Seed>> read_seeds(const fs::path& path) {
  return parse_file(path, read_rows).map([](const std::vector<Row>& rows) {
    std::vector<ultrasound::Seed> seeds;
    for (const Row& row : rows) seeds.push_back({row.frame, row.at_px});
    return seeds;
  });
}

}  // namespace brainshift::io
