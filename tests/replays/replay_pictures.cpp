// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/replay_pictures.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "client/tools/pictures/chart.hpp"
#include "tests/replays/replay_rows.hpp"
#include "tests/replays/replay_tables.hpp"

namespace brainshift::replays {
namespace {

using client::Marker;
using client::Series;
using surgeries::Rows;
namespace palette = client::palette;

Series series_of(const std::string& legend, std::size_t surgery) {
  const cv::Scalar colours[] = {palette::kBlue, palette::kVermillion, palette::kGreen,
                                palette::kPurple, palette::kOrange};
  const Marker markers[] = {Marker::kCircle, Marker::kSquare, Marker::kTriangle};
  Series series;
  series.legend = legend;
  series.colour = colours[surgery % std::size(colours)];
  series.marker = markers[surgery % std::size(markers)];
  series.line = true;
  return series;
}

std::string speed_title(const std::string& speed) {
  return speed == kRecordedSpeed ? "at the recorded times (1x)" : "at full speed";
}

client::ChartSpec latency_panel(const Rows& rows, const std::string& speed) {
  client::ChartSpec spec;
  spec.title = "Latency of updates, " + speed_title(speed);
  spec.subtitle = "from sending an observation to its field at the client, loopback, journal on";
  spec.x = {.label = "latency / t_solve", .log = true};
  spec.y = {.label = "share that takes longer", .log = true};
  const std::vector<std::string> surgeries = rows.values("surgery");
  for (std::size_t s = 0; s < surgeries.size(); ++s) {
    const Rows own = rows.where("surgery", surgeries[s]).where([](const Rows& all, std::size_t i) {
      return all.number(i, "update") > 1.0;
    });
    std::vector<double> ratios;
    for (std::size_t i = 0; i < own.size(); ++i) {
      ratios.push_back(own.number(i, "latency_ms") / own.number(i, "t_solve_ms"));
    }
    // What has no latency cannot be shown.
    ratios.erase(std::remove_if(ratios.begin(), ratios.end(), [](double r) { return !(r > 0.0); }),
                 ratios.end());
    std::sort(ratios.begin(), ratios.end());
    const auto count = static_cast<double>(ratios.size());
    Series series = series_of(surgeries[s] + " (" + std::to_string(ratios.size()) + ")", s);
    series.marker = Marker::kNone;
    series.dash_px = 7.0 * static_cast<double>(s % 3);
    for (std::size_t i = 0; i < ratios.size(); ++i) {
      series.points.push_back({ratios[i], 1.0 - (static_cast<double>(i) + 0.5) / count, ""});
    }
    spec.series.push_back(std::move(series));
  }
  return spec;
}

client::ChartSpec stage_panel(const Rows& rows, const std::string& speed) {
  client::ChartSpec spec;
  spec.title = "Stages of updates, " + speed_title(speed);
  spec.subtitle = "p50 (lower mark) to p95 (upper mark)";
  spec.x = {.label = "stage", .from_zero = false, .names = stage_names()};
  spec.y = {.label = "time / t_solve", .log = true};
  const std::vector<std::string> surgeries = rows.values("surgery");
  const auto n = static_cast<double>(surgeries.size());
  for (const StageTimes& one : stage_times(rows)) {
    const auto s = static_cast<std::size_t>(
        std::find(surgeries.begin(), surgeries.end(), one.surgery) - surgeries.begin());
    const auto stage = static_cast<std::size_t>(
        std::find(stage_names().begin(), stage_names().end(), one.stage) - stage_names().begin());
    Series series = series_of(stage == 0 ? one.surgery : "", s);
    const double x = static_cast<double>(stage) + 0.7 * ((static_cast<double>(s) + 0.5) / n - 0.5);
    series.points = {{x, one.p50_solves, ""}, {x, one.p95_solves, ""}};
    spec.series.push_back(std::move(series));
  }
  return spec;
}

using PanelOf = std::function<client::ChartSpec(const Rows&, const std::string&)>;

Status draw(const Rows& rows, const PanelOf& panel_of, const std::filesystem::path& file) {
  std::vector<cv::Mat> panels;
  for (const std::string& speed : rows.values("speed")) {
    client::ChartSpec spec = panel_of(rows.where("speed", speed), speed);
    spec.size = {1800, 820};
    panels.push_back(client::draw_chart(spec));
  }
  cv::Mat sheet;
  cv::vconcat(panels, sheet);
  if (cv::imwrite(file.string(), sheet)) return {};
  return fail(ErrorCode::kWriteFailed, file.string() + ": cannot be written");
}

}  // namespace

Status draw_replays(const Rows& rows, const std::filesystem::path& folder) {
  if (Status ok = draw(rows, latency_panel, folder / "replays-latency.png"); !ok) return ok;
  return draw(rows, stage_panel, folder / "replays-stages.png");
}

}  // namespace brainshift::replays
