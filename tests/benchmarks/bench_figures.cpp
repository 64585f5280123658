// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/bench_figures.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <utility>

#include "client/tools/pictures/chart.hpp"
#include "common/values/estimate.hpp"
#include "tests/benchmarks/pareto.hpp"

namespace brainshift::bench {
namespace {

namespace fs = std::filesystem;
namespace palette = client::palette;
using client::ChartSpec;
using client::Marker;
using client::Series;

constexpr double kMib = 1024.0 * 1024.0;

cv::Scalar colour_of(const std::string& method) {
  const cv::Scalar colours[] = {palette::kBlue,   palette::kSkyBlue, palette::kVermillion,
                                palette::kOrange, palette::kGreen,   palette::kPurple};
  for (std::size_t i = 0; i < std::size(kAllMethods); ++i) {
    if (method == to_string(kAllMethods[i])) return colours[i % std::size(colours)];
  }
  return palette::kInk;
}

Result<fs::path> save(const fs::path& file, const cv::Mat& image) {
  if (!cv::imwrite(file.string(), image)) {
    return fail(ErrorCode::kWriteFailed, file.string() + ": cannot be written");
  }
  return file;
}

using Error = double MethodSummary::*;

// One panel: a point per method, number of modes and start.
ChartSpec error_panel(const std::vector<MethodSummary>& methods, Error error,
                      const std::string& what) {
  ChartSpec spec;
  spec.title = "Error against run time: mesh " + methods.front().mesh + ", scenario " +
               methods.front().scenario;
  spec.subtitle = "median time; mean error over " + std::to_string(methods.front().compared) +
                  " measurement(s) that all methods got; numbers: modes of the prior";
  spec.x = {"time of one estimate (ms)", true};
  spec.y = {what, true};
  std::vector<std::pair<double, double>> points;
  for (const MethodSummary& one : methods) points.emplace_back(one.p50_ms, one.*error);
  Series front{"Pareto front", palette::kGrey, Marker::kNone, true, 12.0, {}};
  for (const std::size_t i : pareto_front(points)) {
    front.points.push_back({points[i].first, points[i].second, ""});
  }
  spec.series.push_back(front);
  for (const MethodSummary& one : methods) {
    if (!std::isfinite(one.p50_ms) || !std::isfinite(one.*error)) continue;
    const bool own = one.prior == "paper";
    const std::string name = one.method == "condensed" ? one.method + ", " + one.start
                             : own                     ? one.method + ", the paper's prior"
                                                       : one.method;
    auto found = std::find_if(spec.series.begin(), spec.series.end(),
                              [&](const Series& s) { return s.legend == name; });
    if (found == spec.series.end()) {
      const Marker marker = own                   ? Marker::kSquare
                            : one.start == "warm" ? Marker::kCircle
                                                  : Marker::kTriangle;
      spec.series.push_back({name, colour_of(one.method), marker, false, 0.0, {}});
      found = spec.series.end() - 1;
    }
    found->points.push_back({one.p50_ms, one.*error, one.rank > 0 ? std::to_string(one.rank) : ""});
  }
  return spec;
}

Status draw_errors(const Results& results, const fs::path& folder, std::vector<fs::path>& files) {
  std::set<std::pair<std::string, std::string>> seen;
  for (const MethodSummary& each : results.methods) {
    if (!seen.insert({each.mesh, each.scenario}).second) continue;
    std::vector<MethodSummary> methods;
    for (const MethodSummary& one : results.methods) {
      if (one.mesh == each.mesh && one.scenario == each.scenario) methods.push_back(one);
    }
    cv::Mat sheet;
    cv::vconcat(client::draw_chart(error_panel(methods, &MethodSummary::cross_mm,
                                               "mean error at the tumour (mm)")),
                client::draw_chart(error_panel(methods, &MethodSummary::field_mean_mm,
                                               "mean error of the whole field (mm)")),
                sheet);
    auto file = save(folder / ("error_time-" + each.mesh + "-" + each.scenario + ".png"), sheet);
    if (!file) return tl::unexpected(file.error());
    files.push_back(*file);
  }
  return {};
}

Status draw_latency(const Results& results, const fs::path& folder, std::vector<fs::path>& files) {
  // Colour and dash length; the longest are told apart by both.
  const std::vector<std::pair<cv::Scalar, double>> styles = {
      {palette::kVermillion, 0.0}, {palette::kOrange, 8.0},  {palette::kPurple, 0.0},
      {palette::kGreen, 18.0},     {palette::kSkyBlue, 0.0}, {palette::kGreen, 0.0},
      {palette::kBlue, 0.0}};
  ChartSpec spec;
  spec.title = "Latency of updates through daemon and client, loopback";
  spec.subtitle = "condensed method, contact; the first update of each session is not included";
  spec.x = {"latency (ms)", true};
  spec.y = {"share of updates that take longer", true};
  const auto other_kernel = [](const std::string& name) {
    return name.find('@') != std::string::npos;
  };
  for (const auto& [scenario, latency] : results.latency_ms) {
    if (latency.size() < 2 || other_kernel(scenario)) continue;
    std::vector<double> sorted = latency;
    std::sort(sorted.begin(), sorted.end());
    const auto& style = styles[spec.series.size() % styles.size()];
    Series series{scenario + " (" + std::to_string(sorted.size()) + ")",
                  style.first,
                  Marker::kNone,
                  true,
                  style.second,
                  {}};
    const auto count = static_cast<double>(sorted.size());
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      series.points.push_back({sorted[i], 1.0 - (static_cast<double>(i) + 0.5) / count, ""});
    }
    spec.series.push_back(std::move(series));
  }
  if (spec.series.empty()) return {};
  double t_solve = 0.0;
  for (const auto& [scenario, run] : results.runs) {
    if (!other_kernel(scenario)) t_solve = std::max(t_solve, run.full_solve_ms.value_or(0.0));
  }
  spec.series.push_back({"t_solve",
                         palette::kInk,
                         Marker::kNone,
                         true,
                         5.0,
                         {{t_solve, 1.0, ""}, {t_solve, 1e-3, ""}}});
  auto file = save(folder / "latency.png", client::draw_chart(spec));
  if (!file) return tl::unexpected(file.error());
  files.push_back(*file);
  return {};
}

Series over_nodes(const Results& results, const std::string& legend, const char* column,
                  double unit, const cv::Scalar& colour, Marker marker) {
  Series series{legend, colour, marker, true, 0.0, {}};
  for (std::size_t row = 0; row < results.meshes.rows(); ++row) {
    const std::string& name = results.meshes.text(row, "mesh");
    if (name.find("refined") != std::string::npos) continue;  // not of this family
    series.points.push_back(
        {results.meshes.number(row, "nodes"), results.meshes.number(row, column) / unit, ""});
  }
  std::sort(series.points.begin(), series.points.end(),
            [](const auto& a, const auto& b) { return a.x < b.x; });
  return series;
}

Series updates_over_nodes(const Results& results, const std::string& scenario,
                          const std::string& start, const cv::Scalar& colour, Marker marker) {
  Series series = over_nodes(results, scenario + ", " + start, "nodes", 1.0, colour, marker);
  for (auto& point : series.points) {
    double time_ms = std::nan("");
    for (std::size_t row = 0; row < results.meshes.rows(); ++row) {
      const MethodSummary* one =
          results.find(results.meshes.text(row, "mesh"), scenario, "condensed", start);
      if (results.meshes.number(row, "nodes") == point.x && one != nullptr) time_ms = one->p50_ms;
    }
    point.y = time_ms;
  }
  return series;
}

Status draw_growth(const Results& results, const fs::path& folder, std::vector<fs::path>& files) {
  if (results.meshes.rows() < 2) return {};  // one mesh shows no growth
  ChartSpec time, memory, update;
  time.title = "Preparation against mesh size";
  time.subtitle = "contact boundary";
  time.y = {"time (s)", true};
  time.series = {
      over_nodes(results, "factor", "factor_s", 1.0, palette::kOrange, Marker::kTriangle),
      over_nodes(results, "condense", "condense_s", 1.0, palette::kBlue, Marker::kCircle)};
  memory.title = "Memory against mesh size";
  memory.subtitle = "contact boundary";
  memory.y = {"memory (MiB)", true};
  memory.series = {over_nodes(results, "factor, matrix, prior", "factor_bytes", kMib,
                              palette::kOrange, Marker::kTriangle),
                   over_nodes(results, "condensed operators", "operator_bytes", kMib,
                              palette::kBlue, Marker::kCircle),
                   over_nodes(results, "peak of the preparation", "peak_rss_bytes", kMib,
                              palette::kVermillion, Marker::kSquare)};
  update.title = "Update of the condensed method against mesh size";
  update.subtitle = "median; largest number of modes";
  update.y = {"time (ms)", true};
  update.series = {
      over_nodes(results, "t_solve", "t_solve_ms", 1.0, palette::kInk, Marker::kNone),
      updates_over_nodes(results, "paper", "warm", palette::kBlue, Marker::kCircle),
      updates_over_nodes(results, "paper", "cold", palette::kSkyBlue, Marker::kTriangle),
      updates_over_nodes(results, "distension", "warm", palette::kVermillion, Marker::kCircle),
      updates_over_nodes(results, "distension", "cold", palette::kOrange, Marker::kTriangle)};
  std::vector<cv::Mat> panels;
  for (ChartSpec* spec : {&time, &memory, &update}) {
    spec->x = {"nodes", true};
    spec->size.height = 820;
    panels.push_back(client::draw_chart(*spec));
  }
  cv::Mat sheet;
  cv::vconcat(panels, sheet);
  auto file = save(folder / "growth.png", sheet);
  if (!file) return tl::unexpected(file.error());
  files.push_back(*file);
  return {};
}

}  // namespace

Result<std::vector<fs::path>> draw_figures(const Results& results, const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto draw : {&draw_errors, &draw_latency, &draw_growth}) {
    if (Status ok = draw(results, folder, files); !ok) return tl::unexpected(ok.error());
  }
  return files;
}

}  // namespace brainshift::bench
