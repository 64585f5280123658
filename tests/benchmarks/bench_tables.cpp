// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <fstream>
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

void machine(std::ostringstream& out, const std::string& commit) {
  std::istringstream memory(first_field("/proc/meminfo", "MemTotal"));
  double kib = 0.0;
  memory >> kib;
  out << "Processor: " << first_field("/proc/cpuinfo", "model name") << ", "
      << std::thread::hardware_concurrency() << " logical cores, OpenBLAS kernel "
      << linalg::blas_kernel() << "; memory " << cell(kib / kMib, 3) << " GiB; commit " << commit
      << ".\n";
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
    for (const char* column : {"edge_mm", "t_solve_ms", "factor_s", "condense_s"}) {
      out << " | " << cell(meshes.number(row, column));
    }
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
  out << "\n| mesh | scenario | method | modes | start | n | p50 ms | max ms | of t_solve | tumour "
         "error mm | field error mm | largest mm | coverage | active | iterations | status |\n"
         "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const MethodSummary& one : results.methods) {
    out << "| " << one.mesh << " | " << one.scenario << " | " << one.method << " | "
        << (one.rank > 0 ? std::to_string(one.rank) : "-") << " | " << one.start << " | "
        << one.repetitions << " | " << cell(one.p50_ms) << " | " << cell(one.max_ms) << " | "
        << cell(one.over_tsolve) << " | " << cell(one.cross_mm) << " | " << cell(one.field_mean_mm)
        << " | " << cell(one.field_max_mm) << " | " << cell(one.coverage_90) << " | "
        << whole(one.active) << " | " << cell(one.iterations) << " | " << one.status << " |\n";
  }
}

void latency_table(std::ostringstream& out, const Results& results) {
  out << "\n| scenario | updates | first ms | p50 ms | p95 ms | p99 ms | max ms | t_solve ms | "
         "p50 of t_solve | active |\n|---|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& [scenario, run] : results.runs) {
    if (!run.latency_ms) continue;
    const auto& latency = *run.latency_ms;
    const double t_solve = run.full_solve_ms.value_or(std::nan(""));
    out << "| " << scenario << " | " << run.updates << " | "
        << cell(run.cold_ms.value_or(std::nan("")));
    for (const double value :
         {latency.p50, latency.p95, latency.p99, latency.max, t_solve, latency.p50 / t_solve}) {
      out << " | " << cell(value);
    }
    out << " | " << (run.contact ? std::to_string(run.contact->active) : "-") << " |\n";
  }
}

}  // namespace

std::string tables(const Results& results, const std::vector<Check>& checks,
                   const std::string& commit) {
  std::ostringstream out;
  machine(out, commit);
  out << "\n### Checks\n";
  check_table(out, checks);
  out << "\n### Latency through daemon and client, loopback\n";
  latency_table(out, results);
  out << "\n### Growth with the mesh\n";
  mesh_table(out, results);
  out << "\n### Methods\n";
  method_table(out, results);
  return out.str();
}

}  // namespace brainshift::bench
