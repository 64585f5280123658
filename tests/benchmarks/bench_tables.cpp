// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <fstream>
#include <initializer_list>
#include <map>
#include <sstream>
#include <thread>

#include "common/core/statistics.hpp"
#include "common/linalg/blas_kernel.hpp"
#include "tests/benchmarks/bench_checks.hpp"

namespace brainshift::bench {
namespace {

constexpr double kMib = 1024.0 * 1024.0;

std::string cell(double value, int digits = 3) {
  return std::isfinite(value) ? csv_number(value, digits) : "-";
}

std::string whole(double value) {
  return std::isfinite(value) ? std::to_string(std::lround(value)) : "-";
}

void numbers(std::ostringstream& out, const CsvTable& table, std::size_t row,
             std::initializer_list<const char*> columns) {
  for (const char* column : columns) out << " | " << cell(table.number(row, column));
}

std::string first_field(const char* file, const std::string& key) {
  std::ifstream text(file);
  for (std::string line; std::getline(text, line);) {
    const std::size_t colon = line.find(':');
    if (line.rfind(key, 0) != 0 || colon == std::string::npos) continue;
    const std::size_t begin = line.find_first_not_of(" \t", colon + 1);
    return begin == std::string::npos ? "" : line.substr(begin);
  }
  return "unknown";
}

void check_table(std::ostringstream& out, const std::vector<Check>& checks) {
  out << "\n| check | value | bound | holds |\n|---|---|---|---|\n";
  for (const Check& check : checks) {
    out << "| " << check.name << " | " << cell(check.value) << " | " << check.bound << " | "
        << (check.pass                   ? "yes"
            : std::isfinite(check.value) ? "**no**"
                                         : "not measured")
        << " |\n";
  }
}

void mesh_table(std::ostringstream& out, const Results& results) {
  out << "\n| mesh | nodes | tetrahedra | slaves | edge mm | t_solve ms | factor s | condense s | "
         "operators MiB | peak memory MiB | warm update ms | of t_solve |\n"
         "|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  const CsvTable& meshes = results.meshes;
  for (std::size_t row = 0; row < meshes.rows(); ++row) {
    const std::string& name = meshes.text(row, "mesh");
    const MethodSummary* warm = results.find(name, "paper", "condensed", "warm");
    out << "| " << name;
    for (const char* column : {"nodes", "tets", "slaves"}) out << " | " << meshes.text(row, column);
    numbers(out, meshes, row, {"edge_mm", "t_solve_ms", "factor_s", "condense_s"});
    for (const char* column : {"operator_bytes", "peak_rss_bytes"}) {
      out << " | " << whole(meshes.number(row, column) / kMib);
    }
    out << " | " << (warm ? cell(warm->p50_ms) : "-") << " | "
        << (warm ? cell(warm->over_tsolve) : "-") << " |\n";
  }
}

void method_table(std::ostringstream& out, const Results& results) {
  out << "\nTimes are over n repetitions, errors over those repetitions that all methods of a mesh "
         "and "
         "scenario have.\n";
  out << "\n| mesh | scenario | method | prior | modes | start | n | p50 ms | max ms | of t_solve "
         "| tumour "
         "error mm | field error mm | largest mm | coverage | active | iterations | status |\n"
         "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const MethodSummary& one : results.methods) {
    out << "| " << one.mesh << " | " << one.scenario << " | " << one.method << " | " << one.prior
        << " | " << (one.rank > 0 ? std::to_string(one.rank) : "-") << " | " << one.start << " | "
        << one.repetitions << " | " << cell(one.p50_ms) << " | " << cell(one.max_ms) << " | "
        << cell(one.over_tsolve) << " | " << cell(one.cross_mm) << " | " << cell(one.field_mean_mm)
        << " | " << cell(one.field_max_mm) << " | " << cell(one.coverage_90) << " | "
        << whole(one.active) << " | " << cell(one.iterations) << " | " << one.status << " |\n";
  }
}

void latency_table(std::ostringstream& out, const Results& results) {
  out << "\n| surgery | updates | first ms | p50 ms | p95 ms | p99 ms | max ms | t_solve ms | "
         "p50 of t_solve | active |\n|---|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& [name, run] : results.runs) {
    if (!run.latency_ms) continue;
    const auto& latency = *run.latency_ms;
    const double t_solve = run.full_solve_ms.value_or(std::nan(""));
    out << "| " << name << " | " << run.updates << " | "
        << cell(run.cold_ms.value_or(std::nan("")));
    for (const double value :
         {latency.p50, latency.p95, latency.p99, latency.max, t_solve, latency.p50 / t_solve}) {
      out << " | " << cell(value);
    }
    out << " | " << (run.contact ? std::to_string(run.contact->active) : "-") << " |\n";
  }
}

// A row per stage, a column per surgery.
void stage_table(std::ostringstream& out, const Results& results) {
  const CsvTable& table = results.stages;
  std::vector<std::string> surgeries, stages;
  std::map<std::pair<std::string, std::string>, double> cells;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const std::string &surgery = table.text(row, "surgery"), &stage = table.text(row, "stage");
    if (std::find(surgeries.begin(), surgeries.end(), surgery) == surgeries.end()) {
      surgeries.push_back(surgery);
    }
    if (std::find(stages.begin(), stages.end(), stage) == stages.end()) stages.push_back(stage);
    cells[{surgery, stage}] = table.number(row, "over_tsolve");
  }
  out << "\nMedians in units of t_solve, in one process without messages.\n\n| stage |";
  for (const auto& surgery : surgeries) out << ' ' << surgery << " |";
  out << "\n|---|";
  for (std::size_t i = 0; i < surgeries.size(); ++i) out << "---|";
  out << '\n';
  for (const auto& stage : stages) {
    out << "| " << stage << " |";
    for (const auto& surgery : surgeries) out << ' ' << cell(cells[{surgery, stage}], 2) << " |";
    out << '\n';
  }
}

void scene_table(std::ostringstream& out, const Results& results) {
  out << "\n| surgery | left out | active | largest displacement mm | change mm | estimate of it "
         "mm "
         "| invert ms | rebuild ms |\n|---|---|---|---|---|---|---|---|\n";
  const CsvTable& scenes = results.scenes;
  for (std::size_t row = 0; row < scenes.rows(); ++row) {
    out << "| " << scenes.text(row, "scenario") << " | " << scenes.text(row, "left_out") << " | "
        << scenes.text(row, "active");
    numbers(out, scenes, row,
            {"largest_mm", "difference_mm", "estimate_mm", "invert_ms", "rebuild_ms"});
    out << " |\n";
  }
}

}  // namespace

std::string machine_line(const std::string& commit) {
  std::istringstream memory(first_field("/proc/meminfo", "MemTotal"));
  double kib = 0.0;
  memory >> kib;
  return first_field("/proc/cpuinfo", "model name") + ", " +
         std::to_string(std::thread::hardware_concurrency()) + " logical cores, BLAS kernel " +
         linalg::blas_kernel() + "; memory " + cell(kib / kMib, 3) + " GiB; commit " + commit;
}

std::string tables(const Results& results, const std::vector<Check>& checks) {
  std::ostringstream out;
  out << "Processor: " << results.machine << ".\n";
  out << "\n### Checks\n";
  check_table(out, checks);
  out << "\n### Latency through daemon and client, loopback\n";
  latency_table(out, results);
  out << "\n### Where the time of an update goes\n";
  stage_table(out, results);
  out << "\n### What leaving out parts of a scene saves and costs\n";
  scene_table(out, results);
  out << "\n### Growth with the mesh\n";
  mesh_table(out, results);
  out << "\n### Methods\n";
  method_table(out, results);
  if (!results.left_out.empty()) out << "\n### Left out\n\n";
  for (const std::string& line : results.left_out) out << "- " << line << '\n';
  return out.str();
}

}  // namespace brainshift::bench
