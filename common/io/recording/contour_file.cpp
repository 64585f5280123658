// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/contour_file.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
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
  double time_s = std::numeric_limits<double>::quiet_NaN();
  Eigen::Vector2d at_px = Eigen::Vector2d::Zero();

  bool same_image(const Row& other) const {
    return std::isnan(time_s) ? frame == other.frame : time_s == other.time_s;
  }
  std::string image() const {
    return std::isnan(time_s) ? fmt::format("frame {}", frame) : fmt::format("time {:.6f}", time_s);
  }
};

using RowColumns = std::array<std::size_t, 3>;  // frame or time, u, v

struct RowForm {
  RowColumns columns = {0, 1, 2};
  bool timed = false;  // images are named by their time
};

std::optional<RowForm> row_form(const Heading& heading) {
  const Heading::Words pixels = {"px", "pixel", "pixels"};
  auto image = heading.column({"frame", "image"}, {"number", "index"});
  const auto time = heading.column({"time"}, {"s"});
  const auto u = heading.column({"u", "x"}, pixels), v = heading.column({"v", "y"}, pixels);
  if (image.has_value() == time.has_value() || !u || !v) return std::nullopt;
  return RowForm{{image ? *image : *time, *u, *v}, time.has_value()};
}

bool parse_row(const Cells& cells, const RowForm& form, Row& row) {
  double numbers[3];
  for (std::size_t i = 0; i < 3; ++i) {
    if (form.columns[i] >= cells.size() || !parse_number(cells[form.columns[i]], numbers[i])) {
      return false;
    }
  }
  row.at_px = {numbers[1], numbers[2]};
  const double frame = numbers[0];
  if (form.timed) {
    row.time_s = frame;
    return frame > 0.0;
  }
  if (frame < 0.0 || frame > kMaxFrames || frame != std::floor(frame)) return false;
  row.frame = static_cast<int>(frame);
  return true;
}

Result<std::vector<Row>> read_rows(const std::string& content) {
  const Table table = parse_table(content, true);
  std::optional<RowForm> form = RowForm{};
  if (table.heading) form = row_form(*table.heading);
  if (!form) {
    return bad_line(table.heading_row.line, table.heading_row.text,
                    "must name the columns frame (or time_s), u_px and v_px, each once");
  }
  std::vector<Row> rows;
  for (const TableRow& cells : table.rows) {
    Row row;
    row.line = cells.line;
    const std::size_t size = table.heading ? table.heading->size() : 3;
    if (cells.cells.size() != size || !parse_row(cells.cells, *form, row)) {
      return bad_line(cells.line, cells.text,
                      form->timed ? "must be time_s,u_px,v_px with a time since 1970"
                                  : "must be frame,u_px,v_px with a frame from 0");
    }
    rows.push_back(row);
  }
  if (rows.empty()) return fail(ErrorCode::kEmptySet, "holds no row frame,u_px,v_px");
  return rows;
}

Result<std::vector<ultrasound::Contour>> contours_of_rows(const std::vector<Row>& rows,
                                                          bool closed) {
  std::vector<ultrasound::Contour> contours;
  std::set<std::pair<int, double>> finished;
  const auto key = [](const Row& row) {
    return std::pair(row.frame, std::isnan(row.time_s) ? 0.0 : row.time_s);
  };
  for (std::size_t first = 0; first < rows.size();) {
    std::size_t end = first;
    while (end < rows.size() && rows[end].same_image(rows[first])) ++end;
    if (!finished.insert(key(rows[first])).second) {
      return unreadable(
          fmt::format("line {}: {} comes a second time", rows[first].line, rows[first].image()));
    }
    ultrasound::Contour contour;
    contour.frame = rows[first].frame;
    contour.time_s = rows[first].time_s;
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
    if (key != "frame" && key != "time_s" && key != "closed" && key != "points_px")
      return "key " + key + " is unknown";
  }
  const auto time = entry.find("time_s");
  const auto frame = entry.find("frame");
  if (time != entry.end()) {
    if (frame != entry.end()) return "frame and time_s: one of them";
    if (!time->is_number() || !(time->get<double>() > 0.0))
      return "time_s must be a time since 1970";
    contour.time_s = time->get<double>();
  } else if (frame == entry.end() || !frame->is_number_unsigned() || *frame > kMaxFrames) {
    return "frame must be a whole number from 0";
  } else {
    contour.frame = frame->get<int>();
  }
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
    for (const Row& row : rows) seeds.push_back({row.frame, row.at_px, row.time_s});
    return seeds;
  });
}

}  // namespace brainshift::io
