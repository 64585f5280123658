// SPDX-License-Identifier: GPL-3.0-or-later
// Sweeps the product to the edges of what may be asked of it and compares every answer with
// another method; then makes one operator of the product wrong at a time and asks again. Writes
// points.csv and seeded.csv, a row per point. Which answers are wrong, and whether the comparison
// noticed the faults, tests/studies/stability.py judges.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/linalg/openblas.hpp"
#include "tests/benchmarks/csv_table.hpp"
#include "tests/stability/stability_point.hpp"

namespace brainshift::stability {
namespace {

namespace fs = std::filesystem;

struct Sheet {
  std::string name;
  void (*sweep)(const Options&);
};
const std::vector<Sheet> kSheets = {
    {"penalty", sweep_penalty},   {"material", sweep_material},
    {"mesh", sweep_mesh},         {"load", sweep_load},
    {"data", sweep_data},         {"contact", sweep_contact},
    {"elements", sweep_elements}, {"consolidation", sweep_consolidation},
};

struct Arguments {
  fs::path out = "out/stability";
  std::vector<std::string> sheets;
  bool coarse = false;
  Fault fault = Fault::kNone;

  bool chosen(const std::string& sheet) const {
    return sheets.empty() || std::find(sheets.begin(), sheets.end(), sheet) != sheets.end();
  }
};

// A cell of a table holds no comma, quote or line break.
std::string cell(std::string text) {
  std::replace(text.begin(), text.end(), ',', ';');
  std::replace(text.begin(), text.end(), '"', '\'');
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

constexpr const char* kHeading =
    "sheet,fault,parameter,x,row,answered,warned,status,backward_error,rcond,iterations,"
    "min_volume_ratio,difference,bound,unit,must_warn,set,from_posterior_mm,scales_gain,objection,"
    "reason";

// What is compared, in full; the rest with four digits.
std::vector<std::string> cells_of(const Point& p, Fault fault) {
  const auto number = [](double value) { return bench::csv_number(value, 4); };
  const auto full = [](double value) { return bench::csv_number(value, 17); };
  const auto only = [&](const std::string& text) { return p.answered ? text : std::string(); };
  const auto flag = [](bool value) { return std::string(value ? "1" : "0"); };
  return {p.sheet,
          to_string(fault),
          cell(p.parameter),
          number(p.x),
          cell(p.row),
          flag(p.answered),
          flag(p.warned),
          p.status,
          only(number(p.backward_error)),
          number(p.rcond),
          only(std::to_string(p.iterations)),
          only(number(p.min_volume_ratio)),
          only(full(p.difference)),
          only(full(p.bound)),
          p.unit,
          flag(p.must_warn),
          only(p.sets),
          only(number(p.from_posterior_mm)),
          only(number(p.scales_gain)),
          cell(p.objection),
          cell(p.reason)};
}

// The number of points, each a row of `csv`.
Result<long> sweep(const Sheet& sheet, Grid grid, Fault fault, bench::CsvWriter& csv) {
  long points = 0;
  Status ok;
  sheet.sweep({grid, fault, [&](const Point& point) {
                 ++points;
                 if (ok) ok = csv.row(cells_of(point, fault));
               }});
  if (!ok) return tl::unexpected(ok.error());
  return points;
}

Status run(const Arguments& arguments) {
  std::error_code error;
  fs::create_directories(arguments.out, error);
  auto points = bench::CsvWriter::create(arguments.out / "points.csv", kHeading);
  if (!points) return tl::unexpected(points.error());
  auto seeded = bench::CsvWriter::create(arguments.out / "seeded.csv", kHeading);
  if (!seeded) return tl::unexpected(seeded.error());
  for (const Sheet& sheet : kSheets) {
    if (!arguments.chosen(sheet.name)) continue;
    const auto start = std::chrono::steady_clock::now();
    const auto swept =
        sweep(sheet, arguments.coarse ? Grid::kCoarse : Grid::kFull, arguments.fault, *points);
    if (!swept) return tl::unexpected(swept.error());
    // The coarse grid is the one of CTest, which seeds single faults by itself.
    if (arguments.fault == Fault::kNone && !arguments.coarse) {
      for (const Fault fault : kFaults) {
        const auto ok = sweep(sheet, Grid::kMiddle, fault, *seeded);
        if (!ok) return tl::unexpected(ok.error());
      }
    }
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf("%-13s %4ld points, %.1f s\n", sheet.name.c_str(), *swept, seconds);
    std::fflush(stdout);
  }
  return {};
}

}  // namespace
}  // namespace brainshift::stability

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  using namespace brainshift;
  CLI::App app{
      "Sweeps to the edges of what may be asked; a row per answer, beside that of another method.",
      "stability_suite"};
  stability::Arguments arguments;
  std::vector<std::string> names;
  for (const auto& sheet : stability::kSheets) names.push_back(sheet.name);
  app.add_option("--out", arguments.out, "folder of points.csv and seeded.csv")
      ->capture_default_str();
  app.add_option("--sheet", arguments.sheets, "only these sheets; see docs/stability.md")
      ->check(CLI::IsMember(names));
  app.add_flag("--coarse", arguments.coarse, "ends and middle of every sweep, no seeded faults");
  app.add_option("--seed-fault", arguments.fault,
                 "make one operator of the product wrong before it solves")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, stability::Fault>{{"sign", stability::Fault::kSign},
                                                  {"normal", stability::Fault::kNormal},
                                                  {"scale", stability::Fault::kScale}}));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "stability_suite: %s (see stability_suite --help)\n", error.what());
    return 2;
  }
  linalg::use_single_threaded_blas();
  const auto ok = stability::run(arguments);
  if (ok) return 0;
  std::fprintf(stderr, "stability_suite: %s\n", ok.error().message.c_str());
  return 1;
}
