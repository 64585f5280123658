// SPDX-License-Identifier: GPL-3.0-or-later
// Turns the records of studies (study_record.hpp) into one chart per study, tables.md and
// summary.json. Exit status 0 only if there are checks and every one holds. A figure without a
// bound is no check: tables.md and summary.json show it without a verdict.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "client/tools/pictures/chart.hpp"
#include "common/io/files/file_access.hpp"
#include "tests/benchmarks/bench_checks.hpp"
#include "tests/benchmarks/csv_table.hpp"

namespace brainshift::test_support {
namespace {

namespace fs = std::filesystem;
namespace palette = client::palette;
using bench::CsvTable;
using client::Marker;

struct Arguments {
  fs::path folder = "out/verify";
  std::string commit = "unknown";
  std::string command = "ctest --preset release -L verification";
  std::string title = "Verification";  // of the charts, before the study's name
};

// Errors, sizes, times and the like span powers of ten; positions and pressures do not.
bool logarithmic(const std::string& axis) {
  const char* const words[] = {"error",    "size",     "steps",     " s",
                               "unknowns", "elements", "roughness", "over bound"};
  if (axis == "T") return true;  // time over consolidation time
  return std::any_of(std::begin(words), std::end(words),
                     [&](const char* word) { return axis.find(word) != std::string::npos; });
}

// "element size mm" -> "element size (mm)": a last word that is a unit.
std::string with_unit(const std::string& axis) {
  if (axis == "T") return "T: time over consolidation time";
  const std::size_t space = axis.find_last_of(' ');
  if (space == std::string::npos) return axis;
  const std::string unit = axis.substr(space + 1);
  const char* const units[] = {"mm", "s", "%", "kPa", "Pa", "N", "MPa"};
  const bool known =
      std::any_of(std::begin(units), std::end(units), [&](const char* one) { return unit == one; });
  return known ? axis.substr(0, space) + " (" + unit + ")" : axis;
}

struct Chart {
  std::string study;
  client::ChartSpec spec;
};

// One chart per study and pair of axes, one line per series, in the order of the record.
std::vector<Chart> charts_of(const CsvTable& points, const std::string& title) {
  const cv::Scalar colours[] = {palette::kBlue,   palette::kVermillion, palette::kGreen,
                                palette::kPurple, palette::kOrange,     palette::kSkyBlue};
  const Marker markers[] = {Marker::kCircle, Marker::kSquare, Marker::kTriangle};
  std::vector<Chart> charts;
  for (std::size_t row = 0; row < points.rows(); ++row) {
    const std::string& study = points.text(row, "study");
    const std::string x = with_unit(points.text(row, "x_name"));
    const std::string y = with_unit(points.text(row, "y_name"));
    auto chart = std::find_if(charts.begin(), charts.end(), [&](const Chart& one) {
      return one.study == study && one.spec.x.label == x && one.spec.y.label == y;
    });
    if (chart == charts.end()) {
      chart = charts.insert(charts.end(), {study, {}});
      chart->spec.title = title + ": " + study;
      chart->spec.x = {x, logarithmic(points.text(row, "x_name"))};
      chart->spec.y = {y, logarithmic(points.text(row, "y_name"))};
    }
    auto& all = chart->spec.series;
    const std::string& legend = points.text(row, "series");
    auto series =
        std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.legend == legend; });
    if (series == all.end()) {
      const std::size_t k = all.size();
      series = all.insert(all.end(), client::Series{});
      series->legend = legend;
      series->colour = colours[k % std::size(colours)];
      series->marker = markers[k % std::size(markers)];
      series->line = true;
      // Exact values: dashed in ink, explained once.
      if (legend.find("series") != std::string::npos) {
        series->marker = Marker::kNone;
        series->colour = palette::kInk;
        series->dash_px = 10.0;
      }
    }
    // An exact value is recorded once per mesh; one curve is enough.
    const double x_value = points.number(row, "x"), y_value = points.number(row, "y");
    const bool known = std::any_of(series->points.begin(), series->points.end(),
                                   [&](const auto& p) { return p.x == x_value && p.y == y_value; });
    if (!known) series->points.push_back({x_value, y_value, ""});
  }
  return charts;
}

// One entry in the legend for all that is known exactly.
void shorten_legend(client::ChartSpec& spec) {
  bool explained = false;
  for (auto& series : spec.series) {
    if (series.marker != Marker::kNone) continue;
    series.legend = explained ? "" : "series";
    explained = true;
  }
}

Result<std::vector<std::string>> draw(std::vector<Chart> charts, const fs::path& folder) {
  std::vector<std::string> names;
  for (Chart& chart : charts) {
    shorten_legend(chart.spec);
    std::string name = chart.study;
    for (int k = 2; std::find(names.begin(), names.end(), name + ".png") != names.end(); ++k) {
      name = chart.study + "-" + std::to_string(k);
    }
    const fs::path file = folder / (name + ".png");
    if (!cv::imwrite(file.string(), client::draw_chart(chart.spec))) {
      return fail(ErrorCode::kWriteFailed, file.string() + ": cannot be written");
    }
    names.push_back(name + ".png");
  }
  return names;
}

std::string verdict(const std::string& pass) {
  return pass.empty() ? "" : pass == "1" ? "yes" : "**no**";
}

std::string markdown(const CsvTable& checks, const Arguments& arguments) {
  std::ostringstream text;
  text << "Commit " << arguments.commit << "; `" << arguments.command << "`\n\n"
       << "| study | figure | value | bound | holds | reference |\n|---|---|---|---|---|---|\n";
  for (std::size_t row = 0; row < checks.rows(); ++row) {
    text << "| " << checks.text(row, "study") << " | " << checks.text(row, "name") << " | "
         << bench::csv_number(checks.number(row, "value"), 3) << " | " << checks.text(row, "bound")
         << " | " << verdict(checks.text(row, "pass")) << " | " << checks.text(row, "source")
         << " |\n";
  }
  return text.str();
}

// True when every check holds.
Result<bool> run(const Arguments& arguments) {
  const auto points = CsvTable::read(arguments.folder / "points.csv");
  if (!points) return tl::unexpected(points.error());
  const auto rows = CsvTable::read(arguments.folder / "checks.csv");
  if (!rows) return tl::unexpected(rows.error());
  const auto left_out = CsvTable::read(arguments.folder / "left_out.csv");
  if (!left_out) return tl::unexpected(left_out.error());
  const auto names = draw(charts_of(*points, arguments.title), arguments.folder);
  if (!names) return tl::unexpected(names.error());
  std::vector<bench::Check> checks;
  int bounded = 0, failed = 0;
  for (std::size_t row = 0; row < rows->rows(); ++row) {
    const std::string& pass = rows->text(row, "pass");
    bench::Check check{rows->text(row, "study") + ": " + rows->text(row, "name"),
                       rows->number(row, "value"), rows->text(row, "bound"), pass == "1",
                       arguments.command};
    check.has_bound = !pass.empty();
    bounded += check.has_bound ? 1 : 0;
    failed += check.has_bound && !check.pass ? 1 : 0;
    std::printf("%-6s %-75s %10s   %s\n",
                !check.has_bound ? "-"
                : check.pass     ? "ok"
                                 : "FAILS",
                check.name.c_str(), bench::csv_number(check.value, 4).c_str(), check.bound.c_str());
    checks.push_back(std::move(check));
  }
  std::vector<std::string> not_run;
  for (std::size_t row = 0; row < left_out->rows(); ++row) {
    not_run.push_back(left_out->text(row, "study") + ": " + left_out->text(row, "reason"));
    std::printf("%-6s %s\n", "left", not_run.back().c_str());
  }
  Status ok =
      io::write_file(arguments.folder / "summary.json", bench::to_json(checks, not_run))
          .and_then([&] {
            return io::write_file(arguments.folder / "tables.md", markdown(*rows, arguments));
          });
  if (!ok) return tl::unexpected(ok.error());
  std::printf("%d checks, %zu figures without a bound, %zu charts in %s\n", bounded,
              checks.size() - static_cast<std::size_t>(bounded), names->size(),
              arguments.folder.c_str());
  return bounded > 0 && failed == 0;
}

}  // namespace
}  // namespace brainshift::test_support

int main(int argc, char** argv) {
  using namespace brainshift;
  CLI::App app{"Charts, table and checks of what studies recorded.", "study_summary"};
  test_support::Arguments arguments;
  app.add_option("--dir", arguments.folder,
                 "folder with points.csv, checks.csv and left_out.csv; results go there")
      ->capture_default_str();
  app.add_option("--commit", arguments.commit, "for tables.md")->capture_default_str();
  app.add_option("--command", arguments.command, "that the figures come from")
      ->capture_default_str();
  app.add_option("--title", arguments.title, "of the charts")->capture_default_str();
  app.footer("Exit status: 0 every check holds, 1 one does not or failure, 2 bad usage or input.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "study_summary: %s (see study_summary --help)\n", error.what());
    return 2;
  }
  const auto pass = test_support::run(arguments);
  if (pass) return *pass ? 0 : 1;
  std::fprintf(stderr, "study_summary: %s\n", pass.error().message.c_str());
  return pass.error().code == ErrorCode::kWriteFailed ? 1 : 2;
}
