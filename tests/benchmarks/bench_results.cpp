// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/bench_results.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "common/core/statistics.hpp"

namespace brainshift::bench {
namespace {

namespace fs = std::filesystem;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double mean_of(const CsvTable& table, const std::vector<std::size_t>& rows, const char* column) {
  std::vector<double> values;
  for (const std::size_t row : rows) {
    const double value = table.number(row, column);
    if (std::isfinite(value)) values.push_back(value);
  }
  return values.empty() ? kNone : mean_std(values).mean;
}

std::vector<double> finite(const CsvTable& table, const std::vector<std::size_t>& rows,
                           const char* column) {
  std::vector<double> values;
  for (const std::size_t row : rows) {
    if (std::isfinite(table.number(row, column))) values.push_back(table.number(row, column));
  }
  return values;
}

// The numbers of the repetitions in which every method of one mesh and scenario gave an estimate.
// A method that gave none at all does not count. Each repetition has its own noise, which moves the
// error more than the choice of method does.
std::set<std::string> shared_repetitions(const CsvTable& table,
                                         const std::vector<std::vector<std::size_t>>& methods) {
  std::optional<std::set<std::string>> shared;
  for (const auto& rows : methods) {
    std::set<std::string> own;
    for (const std::size_t row : rows) {
      if (std::isfinite(table.number(row, "field_mean_mm"))) {
        own.insert(table.text(row, "repetition"));
      }
    }
    if (own.empty()) continue;
    if (!shared) shared = own;
    std::erase_if(*shared, [&](const std::string& one) { return !own.contains(one); });
  }
  return shared.value_or(std::set<std::string>());
}

std::string common_status(const CsvTable& table, const std::vector<std::size_t>& rows) {
  std::size_t converged = 0;
  bool same = true;
  for (const std::size_t row : rows) {
    const std::string& status = table.text(row, "status");
    converged += status == "converged" ? 1 : 0;
    same = same && status == table.text(rows.front(), "status");
  }
  return same ? table.text(rows.front(), "status")
              : std::to_string(converged) + " of " + std::to_string(rows.size()) + " converged";
}

// The tables STEM-*.csv below each other, by name.
Result<CsvTable> read_all(const fs::path& folder, const std::string& stem) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind(stem + "-", 0) == 0 && entry.path().extension() == ".csv") {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    // 5k, 18k, 100k, 18k-refined
    const std::string first = a.filename().string(), second = b.filename().string();
    return std::pair(first.size(), first) < std::pair(second.size(), second);
  });
  CsvTable all;
  for (const fs::path& file : files) {
    const auto table = CsvTable::read(file);
    if (!table) return tl::unexpected(table.error());
    if (Status ok = all.append(*table); !ok) {
      return fail(ErrorCode::kUnreadable, file.string() + ": " + ok.error().message);
    }
  }
  return all;
}

// Numbers at the given pointers of a JSON file, if it is there.
Status read_json(const fs::path& file, const std::map<std::string, std::string>& wanted,
                 std::map<std::string, double>& facts) {
  std::ifstream text(file);
  if (!text) return {};
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded()) return fail(ErrorCode::kUnreadable, file.string() + ": is not JSON");
  for (const auto& [name, pointer] : wanted) {
    const nlohmann::json::json_pointer at(pointer);
    if (json.contains(at) && json[at].is_number()) facts[name] = json[at].get<double>();
  }
  return {};
}

// bench_exactness compares several ranks; what counts is the one in everyday use, the largest.
Status read_direct(const fs::path& file, const std::string& scenario,
                   std::map<std::string, double>& facts) {
  std::ifstream text(file);
  if (!text) return {};
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("reduced") || !json["reduced"].is_array()) {
    return fail(ErrorCode::kUnreadable, file.string() + ": has no array \"reduced\"");
  }
  double rank = -1.0;
  for (const auto& one : json["reduced"]) {
    if (!one.is_object() || one.value("rank", -1.0) <= rank) continue;
    rank = one.value("rank", -1.0);
    facts["direct_max_mm " + scenario] = one.value("max_mm", kNone);
  }
  facts["exact_max_mm " + scenario] = json.value("exact_max_mm", kNone);
  return {};
}

Status read_runs(const fs::path& folder, Results& results) {
  const std::string prefix = "run-";
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string stem = entry.path().stem().string();
    if (stem.rfind(prefix, 0) != 0 || entry.path().extension() != ".json") continue;
    auto runs = client::read_reports(entry.path());
    if (!runs) return tl::unexpected(runs.error());
    const std::string name = stem.substr(prefix.size());
    if (!runs->empty()) results.runs[name] = runs->front();
    const fs::path csv = folder / ("latency-" + name + ".csv");
    if (!fs::exists(csv)) continue;
    const auto table = CsvTable::read(csv);
    if (!table) return tl::unexpected(table.error());
    auto& values = results.latency_ms[name];
    for (std::size_t row = 1; row < table->rows(); ++row) {
      const double value = table->number(row, "latency_ms");
      if (std::isfinite(value)) values.push_back(value);
    }
  }
  return {};
}

Status read_table(const fs::path& file, CsvTable& table) {
  if (!fs::exists(file)) return {};
  auto read = CsvTable::read(file);
  if (!read) return tl::unexpected(read.error());
  table = std::move(*read);
  return {};
}

std::vector<std::string> lines_of(const fs::path& file) {
  std::vector<std::string> lines;
  std::ifstream text(file);
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

// Of one method and repetition: the column's number, where it is finite.
std::map<std::string, double> by_repetition(const CsvTable& table, const MethodSummary& one,
                                            const char* column) {
  std::map<std::string, double> values;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double rank = table.number(row, "rank"), value = table.number(row, column);
    if (table.text(row, "mesh") == one.mesh && table.text(row, "scenario") == one.scenario &&
        table.text(row, "method") == one.method && table.text(row, "prior") == one.prior &&
        table.text(row, "start") == one.start &&
        (std::isfinite(rank) ? static_cast<int>(rank) : 0) == one.rank && std::isfinite(value)) {
      values[table.text(row, "repetition")] = value;
    }
  }
  return values;
}

PairedTest compare(const CsvTable& table, const MethodSummary& first, const MethodSummary& second,
                   const char* column) {
  const auto a = by_repetition(table, first, column), b = by_repetition(table, second, column);
  std::vector<double> of_second, of_first;
  for (const auto& [repetition, error] : a) {
    const auto other = b.find(repetition);
    if (other == b.end()) continue;
    of_first.push_back(error);
    of_second.push_back(other->second);
  }
  return paired_t_test(of_second, of_first);
}

}  // namespace

double Results::fact(const std::string& name) const {
  const auto found = facts.find(name);
  return found == facts.end() ? kNone : found->second;
}

const MethodSummary* Results::find(const std::string& mesh, const std::string& scenario,
                                   const std::string& method, const std::string& start, int rank,
                                   const std::string& prior) const {
  const MethodSummary* best = nullptr;
  for (const MethodSummary& one : methods) {
    if (one.mesh != mesh || one.scenario != scenario || one.method != method ||
        one.start != start || one.prior != prior) {
      continue;
    }
    if (rank != kLargestRank && one.rank != rank) continue;
    if (best == nullptr || one.rank > best->rank) best = &one;
  }
  return best;
}

std::vector<MethodSummary> summarise(const CsvTable& table) {
  std::vector<MethodSummary> summaries;
  std::vector<std::vector<std::size_t>> members;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    MethodSummary key;
    key.mesh = table.text(row, "mesh");
    key.scenario = table.text(row, "scenario");
    key.method = table.text(row, "method");
    key.prior = table.text(row, "prior");
    key.start = table.text(row, "start");
    const double rank = table.number(row, "rank");
    key.rank = std::isfinite(rank) ? static_cast<int>(rank) : 0;
    const auto same = [&](const MethodSummary& one) {
      return one.mesh == key.mesh && one.scenario == key.scenario && one.method == key.method &&
             one.prior == key.prior && one.start == key.start && one.rank == key.rank;
    };
    const auto found = std::find_if(summaries.begin(), summaries.end(), same);
    const auto at = static_cast<std::size_t>(found - summaries.begin());
    if (found == summaries.end()) {
      summaries.push_back(key);
      members.emplace_back();
    }
    members[at].push_back(row);
  }
  for (std::size_t i = 0; i < summaries.size(); ++i) {
    MethodSummary& one = summaries[i];
    const auto& rows = members[i];
    std::vector<std::vector<std::size_t>> rivals;
    for (std::size_t k = 0; k < summaries.size(); ++k) {
      if (summaries[k].mesh == one.mesh && summaries[k].scenario == one.scenario) {
        rivals.push_back(members[k]);
      }
    }
    const auto shared = shared_repetitions(table, rivals);
    std::vector<std::size_t> compared = rows;
    std::erase_if(compared,
                  [&](std::size_t row) { return !shared.contains(table.text(row, "repetition")); });
    one.compared = static_cast<int>(shared.size());
    one.repetitions = static_cast<int>(rows.size());
    // A repetition that was stopped shows how long it was given, not how long it takes.
    std::vector<std::size_t> finished = rows;
    std::erase_if(finished, [&](std::size_t row) {
      return !std::isfinite(table.number(row, "field_mean_mm"));
    });
    one.p50_ms = percentile(finite(table, finished, "time_ms"), 50.0);
    one.max_ms = percentile(finite(table, rows, "time_ms"), 100.0);
    one.over_tsolve = percentile(finite(table, finished, "time_over_tsolve"), 50.0);
    one.cross_mm = mean_of(table, compared, "cross_mm");
    one.field_mean_mm = mean_of(table, compared, "field_mean_mm");
    one.field_max_mm = mean_of(table, compared, "field_max_mm");
    one.coverage_90 = mean_of(table, compared, "coverage_90");
    one.own_coverage_90 = mean_of(table, rows, "coverage_90");
    one.active = mean_of(table, rows, "active");
    one.iterations = mean_of(table, rows, "iterations");
    one.status = common_status(table, rows);
  }
  return summaries;
}

Results::FirstUpdates Results::first_updates(const std::string& suffix) const {
  FirstUpdates first;
  for (const auto& [name, run] : runs) {
    const std::size_t at = name.find('@');
    const std::string kernel = at == std::string::npos ? "" : name.substr(at);
    if (name.rfind("cold-", 0) != 0 || kernel != suffix) continue;
    if (!run.cold_ms || !run.full_solve_ms || !run.contact) continue;
    first.active = first.over_tsolve.empty() ? run.contact->active
                                             : std::min(first.active, run.contact->active);
    first.over_tsolve.push_back(*run.cold_ms / *run.full_solve_ms);
  }
  return first;
}

PairedErrors paired_errors(const CsvTable& table, const MethodSummary& first,
                           const MethodSummary& second) {
  return {compare(table, first, second, "cross_mm"),
          compare(table, first, second, "field_mean_mm")};
}

Result<Results> read_results(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    return fail(ErrorCode::kNotFound, folder.string() + ": the folder does not exist");
  }
  Results results;
  auto meshes = read_all(folder, "meshes");
  if (!meshes) return tl::unexpected(meshes.error());
  auto error_time = read_all(folder, "error_time");
  if (!error_time) return tl::unexpected(error_time.error());
  results.meshes = std::move(*meshes);
  results.error_time = std::move(*error_time);
  results.methods = summarise(results.error_time);
  if (Status ok = read_runs(folder, results); !ok) return tl::unexpected(ok.error());
  if (Status ok = read_table(folder / "stages.csv", results.stages); !ok) {
    return tl::unexpected(ok.error());
  }
  if (Status ok = read_table(folder / "scenes.csv", results.scenes); !ok) {
    return tl::unexpected(ok.error());
  }
  results.left_out = lines_of(folder / "left_out.csv");
  const auto machine = lines_of(folder / "machine.txt");
  if (!machine.empty()) results.machine = machine.front();
  if (fs::exists(folder / "facts.csv")) {
    const auto facts = CsvTable::read(folder / "facts.csv");
    if (!facts) return tl::unexpected(facts.error());
    for (std::size_t row = 0; row < facts->rows(); ++row) {
      results.facts[facts->text(row, "name")] = facts->number(row, "value");
    }
  }
  const std::map<std::string, std::string> prepare = {{"prepare_s", "/total_s"},
                                                      {"prepare_nodes", "/mesh/nodes"},
                                                      {"prepare_peak_bytes", "/peak_memory_bytes"},
                                                      {"model_file_bytes", "/model_file_bytes"}};
  if (Status ok = read_json(folder / "prepare.json", prepare, results.facts); !ok) {
    return tl::unexpected(ok.error());
  }
  const std::map<std::string, std::string> large = {{"large_prepare_s", "/total_s"},
                                                    {"large_peak_bytes", "/peak_memory_bytes"}};
  if (Status ok = read_json(folder / "prepare-100k.json", large, results.facts); !ok) {
    return tl::unexpected(ok.error());
  }
  for (const std::string scenario : {"paper", "distension"}) {
    const fs::path file = folder / ("direct-" + scenario + ".json");
    if (Status ok = read_direct(file, scenario, results.facts); !ok) {
      return tl::unexpected(ok.error());
    }
  }
  return results;
}

}  // namespace brainshift::bench
