// SPDX-License-Identifier: GPL-3.0-or-later
// Sweeps the product to the edges of what may be asked of it and compares every answer with another method. Writes
// points.csv, a map per sheet and summary.json. Exit status 0 only if no point is wrong without saying so.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "client/replay/write_file.hpp"
#include "common/linalg/blas_threads.hpp"
#include "tests/benchmarks/bench_checks.hpp"
#include "tests/benchmarks/csv_table.hpp"
#include "tests/stability/stability_point.hpp"
#include "tests/stability/verdict_map.hpp"

namespace brainshift::stability {
namespace {

namespace fs = std::filesystem;

struct Sheet {
  std::string name;
  std::string title;
  void (*sweep)(const Options&);
};
const std::vector<Sheet> kSheets = {
    {"penalty", "Stability: contact penalty", sweep_penalty},
    {"material", "Stability: material", sweep_material},
    {"mesh", "Stability: bad elements", sweep_mesh},
    {"load", "Stability: large displacement; weak support", sweep_load},
    {"data", "Stability: data and prior", sweep_data},
    {"contact", "Stability: warm start from the wrong contact", sweep_contact},
    {"elements", "Stability: elements near incompressibility", sweep_elements},
    {"consolidation", "Stability: one step of consolidation", sweep_consolidation},
};

struct Arguments {
  fs::path out = "out/stability";
  std::vector<std::string> sheets;
  bool coarse = false;
  bool seed_fault = false;
};

// A cell of a table holds no comma, quote or line break.
std::string cell(std::string text) {
  std::replace(text.begin(), text.end(), ',', ';');
  std::replace(text.begin(), text.end(), '"', '\'');
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

Status write_points(const fs::path& file, const std::vector<Point>& points) {
  auto csv = bench::CsvWriter::create(
      file,
      "sheet,parameter,x,row,verdict,status,backward_error,rcond,iterations,min_volume_ratio,"
      "difference,bound,unit,must_warn,seeded,reason");
  if (!csv) return tl::unexpected(csv.error());
  const auto number = [](double value) { return bench::csv_number(value, 4); };
  for (const Point& p : points) {
    const bool answered = p.answered;
    const auto only = [&](const std::string& text) { return answered ? text : std::string(); };
    if (auto ok = csv->row(
            {p.sheet, cell(p.parameter), number(p.x), cell(p.row), to_string(judge(p)), p.status,
             only(number(p.backward_error)), number(p.rcond), only(std::to_string(p.iterations)),
             only(number(p.min_volume_ratio)), only(number(p.difference)), only(number(p.bound)),
             p.unit, p.must_warn ? "1" : "0", p.seeded ? "1" : "0", cell(p.reason)});
        !ok) {
      return ok;
    }
  }
  return {};
}

long count(const std::vector<Point>& points, const std::string& sheet, Verdict verdict) {
  return std::count_if(points.begin(), points.end(), [&](const Point& p) {
    return (sheet.empty() || p.sheet == sheet) && judge(p) == verdict;
  });
}

// Seeded faults, and those that turned their point red.
std::pair<long, long> faults(const std::vector<Point>& points) {
  const auto seeded = [](const Point& p) { return p.seeded && !p.warned; };
  return {std::count_if(points.begin(), points.end(), seeded),
          std::count_if(points.begin(), points.end(),
                        [&](const Point& p) { return seeded(p) && judge(p) == Verdict::kRed; })};
}

std::vector<Point> sweep(const Sheet& sheet, bool coarse, FaultSeeder* seeder) {
  std::vector<Point> points;
  sheet.sweep({coarse, seeder, [&](const Point& point) {
                 points.push_back(point);
                 if (judge(point) != Verdict::kRed) return;
                 std::printf("  red: %s = %g, %s: %s, difference %.3g above %.3g %s%s; %s\n",
                             point.parameter.c_str(), point.x, point.row.c_str(),
                             point.status.c_str(), point.difference, point.bound,
                             point.unit.c_str(), point.seeded ? " (seeded)" : "",
                             point.reason.c_str());
               }});
  return points;
}

std::vector<bench::Check> checks(const std::vector<Point>& points, const Arguments& arguments) {
  const std::string command = "build/release/bin/stability_suite --out " + arguments.out.string();
  std::vector<bench::Check> all;
  for (const Sheet& sheet : kSheets) {
    const long points_there = std::count_if(points.begin(), points.end(),
                                            [&](const Point& p) { return p.sheet == sheet.name; });
    if (points_there == 0) continue;
    const long red = count(points, sheet.name, Verdict::kRed);
    all.push_back({"stability, " + sheet.name + ": points wrong without saying so, of " +
                       std::to_string(points_there),
                   static_cast<double>(red), "0", red == 0, command + " --sheet " + sheet.name});
  }
  if (arguments.seed_fault || arguments.coarse) return all;
  // A product that refuses everything is never wrong.
  const double green = 100.0 * static_cast<double>(count(points, "", Verdict::kGreen)) /
                       static_cast<double>(points.size());
  all.push_back({"stability: points answered accurately and without a warning, %", green, ">= 50",
                 green >= 50.0, command});
  // Left there by bench_guards.
  if (const auto guards = bench::CsvTable::read(arguments.out / "guards.csv")) {
    for (std::size_t row = 0; row < guards->rows(); ++row) {
      if (guards->text(row, "name") != "share_percent") continue;
      const double share = guards->number(row, "value");
      all.push_back({"guards: share of an update of the default head, %", share, "<= 3",
                     share <= 3.0, "build/release/bin/bench_guards"});
    }
  }
  // The proof that the maps can turn red.
  FaultSeeder seeder(true);
  const auto [seeded, seen] = faults(sweep(kSheets.front(), false, &seeder));
  all.push_back(
      {"stability: seeded faults that turned their point red, of " + std::to_string(seeded),
       static_cast<double>(seen), ">= 0.9 of them", seeded > 0 && 10 * seen >= 9 * seeded,
       command + " --sheet penalty --seed-fault"});
  return all;
}

Result<bool> run(const Arguments& arguments) {
  std::error_code error;
  fs::create_directories(arguments.out, error);
  FaultSeeder seeder(arguments.seed_fault);
  std::vector<Point> points;
  for (const Sheet& sheet : kSheets) {
    const auto& chosen = arguments.sheets;
    if (!chosen.empty() && std::find(chosen.begin(), chosen.end(), sheet.name) == chosen.end()) {
      continue;
    }
    const auto start = std::chrono::steady_clock::now();
    const std::vector<Point> some = sweep(sheet, arguments.coarse, &seeder);
    points.insert(points.end(), some.begin(), some.end());
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf("%-9s %4zu points, %.1f s\n", sheet.name.c_str(), some.size(), seconds);
    std::fflush(stdout);
    const fs::path picture = arguments.out / (sheet.name + ".png");
    if (!cv::imwrite(picture.string(), draw_map(sheet.name, sheet.title, points))) {
      return fail(ErrorCode::kWriteFailed, picture.string() + ": cannot be written");
    }
  }
  if (auto ok = write_points(arguments.out / "points.csv", points); !ok) {
    return tl::unexpected(ok.error());
  }
  const auto all = checks(points, arguments);
  if (auto ok = client::write_file(arguments.out / "summary.json", bench::to_json(all, {})); !ok) {
    return tl::unexpected(ok.error());
  }
  for (const Verdict verdict : kVerdicts) {
    std::printf("%ld %s%s", count(points, "", verdict), to_string(verdict).c_str(),
                verdict == Verdict::kRed ? "\n" : ", ");
  }
  if (arguments.seed_fault) {
    const auto [seeded, seen] = faults(points);
    std::printf("%ld faults seeded in answers without a warning, %ld seen\n", seeded, seen);
  }
  return !points.empty() &&
         std::all_of(all.begin(), all.end(), [](const bench::Check& check) { return check.pass; });
}

}  // namespace
}  // namespace brainshift::stability

int main(int argc, char** argv) {
  using namespace brainshift;
  CLI::App app{
      "Sweeps to the edges of what may be asked; exit status 1 where an answer is wrong "
      "without saying so.",
      "stability_suite"};
  stability::Arguments arguments;
  std::vector<std::string> names;
  for (const auto& sheet : stability::kSheets) names.push_back(sheet.name);
  app.add_option("--out", arguments.out, "folder of points.csv, maps and summary.json")
      ->capture_default_str();
  app.add_option("--sheet", arguments.sheets, "only these sheets; see docs/stability.md")
      ->check(CLI::IsMember(names));
  app.add_flag("--coarse", arguments.coarse, "ends and middle of every sweep");
  app.add_flag("--seed-fault", arguments.seed_fault,
               "change answers behind the product's back at random points: must end red");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "stability_suite: %s (see stability_suite --help)\n", error.what());
    return 2;
  }
  linalg::use_single_threaded_blas();
  const auto pass = stability::run(arguments);
  if (pass) return *pass ? 0 : 1;
  std::fprintf(stderr, "stability_suite: %s\n", pass.error().message.c_str());
  return 1;
}
