// SPDX-License-Identifier: GPL-3.0-or-later
// Sweeps the product to the edges of what may be asked of it and compares every answer with
// another method; then makes one operator of the product wrong at a time and looks whether the
// comparison notices. Writes points.csv, faults.csv, a map per sheet and summary.json. Exit
// status 0 only if no point is wrong without a warning and every fault was found.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "common/io/files/file_access.hpp"
#include "common/linalg/blas_kernel.hpp"
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

Status write_points(const fs::path& file, const std::vector<Point>& points) {
  auto csv = bench::CsvWriter::create(
      file,
      "sheet,parameter,x,row,verdict,status,backward_error,rcond,iterations,min_volume_ratio,"
      "difference,bound,unit,must_warn,set,from_posterior_mm,scales_gain,objection,reason");
  if (!csv) return tl::unexpected(csv.error());
  const auto number = [](double value) { return bench::csv_number(value, 4); };
  for (const Point& p : points) {
    const bool answered = p.answered;
    const auto only = [&](const std::string& text) { return answered ? text : std::string(); };
    if (auto ok = csv->row(
            {p.sheet, cell(p.parameter), number(p.x), cell(p.row), to_string(judge(p)), p.status,
             only(number(p.backward_error)), number(p.rcond), only(std::to_string(p.iterations)),
             only(number(p.min_volume_ratio)), only(number(p.difference)), only(number(p.bound)),
             p.unit, p.must_warn ? "1" : "0", only(p.sets), only(number(p.from_posterior_mm)),
             only(number(p.scales_gain)), cell(p.objection), cell(p.reason)});
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

std::vector<Point> sweep(const Sheet& sheet, Grid grid, Fault fault, bool print) {
  std::vector<Point> points;
  sheet.sweep({grid, fault, [&](const Point& point) {
                 points.push_back(point);
                 if (!print || judge(point) != Verdict::kRed) return;
                 std::printf("  red: %s = %g, %s: %s, difference %.3g, bound %.3g %s; %s; %s\n",
                             point.parameter.c_str(), point.x, point.row.c_str(),
                             point.status.c_str(), point.difference, point.bound,
                             point.unit.c_str(), point.objection.c_str(), point.reason.c_str());
                 std::fflush(stdout);
               }});
  return points;
}

// One fault on one sheet. A row with answers that carry no warning must turn red at one point or
// more.
struct FaultRun {
  std::string sheet;
  Fault fault = Fault::kNone;
  long answers = 0, red = 0;  // without a warning; of those
  long rows = 0, red_rows = 0;
  std::string missed;  // rows that stayed green

  bool found() const { return rows > 0 && red_rows == rows; }
};

FaultRun seed(const Sheet& sheet, Fault fault) {
  FaultRun run;
  run.sheet = sheet.name;
  run.fault = fault;
  std::map<std::string, long> red_of_row;
  for (const Point& point : sweep(sheet, Grid::kMiddle, fault, false)) {
    if (!point.answered || point.warned) continue;
    const bool red = judge(point) == Verdict::kRed;
    ++run.answers;
    run.red += red ? 1 : 0;
    red_of_row[point.parameter + ": " + point.row] += red ? 1 : 0;
  }
  for (const auto& [row, red] : red_of_row) {
    ++run.rows;
    if (red > 0) {
      ++run.red_rows;
    } else {
      run.missed += (run.missed.empty() ? "" : "; ") + row;
    }
  }
  return run;
}

Status write_faults(const fs::path& file, const std::vector<FaultRun>& runs) {
  auto csv = bench::CsvWriter::create(file, "sheet,fault,answers,red,rows,red_rows,missed");
  if (!csv) return tl::unexpected(csv.error());
  for (const FaultRun& run : runs) {
    if (auto ok = csv->row({run.sheet, to_string(run.fault), std::to_string(run.answers),
                            std::to_string(run.red), std::to_string(run.rows),
                            std::to_string(run.red_rows), cell(run.missed)});
        !ok) {
      return ok;
    }
  }
  return {};
}

std::vector<FaultRun> seed_all(const Arguments& arguments) {
  std::vector<FaultRun> runs;
  for (const Sheet& sheet : kSheets) {
    if (!arguments.chosen(sheet.name)) continue;
    for (const Fault fault : kFaults) {
      runs.push_back(seed(sheet, fault));
      const FaultRun& run = runs.back();
      std::printf("%-13s fault %-6s: %ld of %ld answers red, %ld of %ld rows%s%s\n",
                  run.sheet.c_str(), to_string(fault).c_str(), run.red, run.answers, run.red_rows,
                  run.rows, run.missed.empty() ? "" : "; missed: ", run.missed.c_str());
      std::fflush(stdout);
    }
  }
  return runs;
}

std::vector<bench::Check> checks(const std::vector<Point>& points,
                                 const std::vector<FaultRun>& faults, const Arguments& arguments) {
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
  for (const Sheet& sheet : kSheets) {
    const auto of_sheet = [&](const FaultRun& run) { return run.sheet == sheet.name; };
    const long seeded = std::count_if(faults.begin(), faults.end(), of_sheet);
    if (seeded == 0) continue;
    const long found = std::count_if(faults.begin(), faults.end(), [&](const FaultRun& run) {
      return of_sheet(run) && run.found();
    });
    all.push_back({"stability, " + sheet.name + ": seeded faults found (sign, normal, scale)",
                   static_cast<double>(found), std::to_string(seeded), found == seeded,
                   command + " --sheet " + sheet.name});
  }
  if (arguments.fault != Fault::kNone || arguments.coarse || !arguments.sheets.empty()) return all;
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
  return all;
}

Result<bool> run(const Arguments& arguments) {
  std::error_code error;
  fs::create_directories(arguments.out, error);
  std::vector<Point> points;
  for (const Sheet& sheet : kSheets) {
    if (!arguments.chosen(sheet.name)) continue;
    const auto start = std::chrono::steady_clock::now();
    const std::vector<Point> some =
        sweep(sheet, arguments.coarse ? Grid::kCoarse : Grid::kFull, arguments.fault, true);
    points.insert(points.end(), some.begin(), some.end());
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf("%-13s %4zu points, %.1f s\n", sheet.name.c_str(), some.size(), seconds);
    std::fflush(stdout);
    const fs::path picture = arguments.out / (sheet.name + ".png");
    if (!cv::imwrite(picture.string(), draw_map(sheet.name, sheet.title, points))) {
      return fail(ErrorCode::kWriteFailed, picture.string() + ": cannot be written");
    }
  }
  if (auto ok = write_points(arguments.out / "points.csv", points); !ok) {
    return tl::unexpected(ok.error());
  }
  // The coarse grid is the one of CTest, which seeds single faults by itself.
  std::vector<FaultRun> faults;
  if (arguments.fault == Fault::kNone && !arguments.coarse) faults = seed_all(arguments);
  if (auto ok = write_faults(arguments.out / "faults.csv", faults); !ok) {
    return tl::unexpected(ok.error());
  }
  const auto all = checks(points, faults, arguments);
  if (auto ok = io::write_file(arguments.out / "summary.json", bench::to_json(all, {})); !ok) {
    return tl::unexpected(ok.error());
  }
  for (const Verdict verdict : kVerdicts) {
    std::printf("%ld %s%s", count(points, "", verdict), to_string(verdict).c_str(),
                verdict == Verdict::kRed ? "\n" : ", ");
  }
  return !points.empty() &&
         std::all_of(all.begin(), all.end(), [](const bench::Check& check) { return check.pass; });
}

}  // namespace
}  // namespace brainshift::stability

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  using namespace brainshift;
  CLI::App app{
      "Sweeps to the edges of what may be asked; exit status 1 where an answer is wrong "
      "without a warning, or a seeded fault goes unnoticed.",
      "stability_suite"};
  stability::Arguments arguments;
  std::vector<std::string> names;
  for (const auto& sheet : stability::kSheets) names.push_back(sheet.name);
  app.add_option("--out", arguments.out, "folder of points.csv, maps and summary.json")
      ->capture_default_str();
  app.add_option("--sheet", arguments.sheets, "only these sheets; see docs/stability.md")
      ->check(CLI::IsMember(names));
  app.add_flag("--coarse", arguments.coarse, "ends and middle of every sweep, no seeded faults");
  app.add_option("--seed-fault", arguments.fault,
                 "make one operator of the product wrong before it solves: must end red")
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
  const auto pass = stability::run(arguments);
  if (pass) return *pass ? 0 : 1;
  std::fprintf(stderr, "stability_suite: %s\n", pass.error().message.c_str());
  return 1;
}
