// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/bench_checks.hpp"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "common/core/statistics.hpp"

namespace brainshift::bench {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kGib = 1024.0 * 1024.0 * 1024.0;
constexpr double kMib = 1024.0 * 1024.0;
constexpr int kManyActive = 500;
constexpr int kUpdatesForTail = 2000;
constexpr int kUpdatesForGrowth = 10000;

double or_none(const std::optional<double>& value) { return value.value_or(kNone); }

const client::RunReport& run_of(const Results& results, const std::string& scenario) {
  static const client::RunReport none;
  const auto found = results.runs.find(scenario);
  return found == results.runs.end() ? none : found->second;
}

double p50_over_tsolve(const client::RunReport& run) {
  return run.latency_ms ? run.latency_ms->p50 / or_none(run.full_solve_ms) : kNone;
}

Check at_most(std::string name, double value, double bound, const std::string& unit,
              std::string command) {
  return {std::move(name), value, "<= " + csv_number(bound) + (unit.empty() ? "" : " " + unit),
          value <= bound, std::move(command)};
}

std::string replay(const std::string& folder, const std::string& scenario) {
  return "brainshift replay " + folder + "/" + scenario +
         ".surgery --boundary contact --method condensed, see cmake/scripts/bench.sh";
}

void add_updates(const Results& results, const std::string& folder, std::vector<Check>& all) {
  const client::RunReport& sag = run_of(results, "sag-progress");
  const client::RunReport& wide = run_of(results, "distension");
  const client::RunReport& free = run_of(results, "no-contact");
  Check warm = at_most("warm update with contact, p50 / t_solve", p50_over_tsolve(sag), 0.6, "",
                       replay(folder, "sag-progress"));
  warm.pass = warm.pass && sag.contact && sag.contact->active > 0;
  all.push_back(warm);
  Check cold = at_most("cold update with more than 500 active slaves / t_solve",
                       or_none(wide.cold_ms) / or_none(wide.full_solve_ms), 3.0, "",
                       replay(folder, "distension"));
  cold.pass = cold.pass && wide.contact && wide.contact->active > kManyActive;
  all.push_back(cold);
  Check none = at_most("update without contact, p50 / t_solve", p50_over_tsolve(free), 0.3, "",
                       replay(folder, "no-contact"));
  none.pass = none.pass && free.contact && free.contact->active == 0;
  all.push_back(none);
  Check tail{"p99 over 2,000 updates / p50", kNone, "<= 3", false, replay(folder, "sag-progress")};
  const auto latency = results.latency_ms.find("sag-progress");
  if (latency != results.latency_ms.end()) {
    tail.value = percentile(latency->second, 99.0) / percentile(latency->second, 50.0);
    // The first update of the session is not among them.
    tail.pass =
        tail.value <= 3.0 && static_cast<int>(latency->second.size()) + 1 >= kUpdatesForTail;
  }
  all.push_back(tail);
}

// The noise of a measurement moves the error more than the choice of
// method does: fewer are too few.
constexpr int kMeasurements = 4;
void add_paper(const Results& results, const std::string& folder, std::vector<Check>& all) {
  Check check{"paper's method / condensed warm update, time, at the same error or better", kNone,
              ">= 1000", false, "bench_error_time --sizes 18 --scenarios paper --out " + folder};
  const MethodSummary* paper = results.find("18k", "paper", "paper", "cold");
  const MethodSummary* warm = results.find("18k", "paper", "condensed", "warm");
  if (paper != nullptr && warm != nullptr) {
    check.value = paper->p50_ms / warm->p50_ms;
    const PairedErrors errors = paired_errors(results.error_time, *paper, *warm);
    std::ostringstream name;
    name.precision(3);
    name << check.name << " (" << errors.first_mm << " and " << errors.second_mm << " mm over "
         << errors.measurements << " measurements)";
    check.name = name.str();
    check.pass = check.value >= 1000.0 && errors.measurements >= kMeasurements &&
                 errors.second_mm <= errors.first_mm;
  }
  all.push_back(check);
}

void add_exactness(const Results& results, const std::string& folder, std::vector<Check>& all) {
  for (const std::string scenario : {"paper", "distension"}) {
    const std::string command = "bench_exactness --scenario " + scenario + " --out " + folder +
                                "/direct-" + scenario + ".json";
    const std::string where = ", largest difference of a node, scenario " + scenario;
    all.push_back(at_most("condensed against the direct posterior" + where,
                          results.fact("direct_max_mm " + scenario), 0.01, "mm", command));
    all.push_back(at_most("condensed-exact against the direct posterior" + where,
                          results.fact("exact_max_mm " + scenario), 1e-6, "mm", command));
  }
}

void add_preparation(const Results& results, const std::string& folder, std::vector<Check>& all) {
  const std::string prepare =
      "brainshiftd prepare --case config/cases/colin27.yaml --out " + folder + "/colin27.h5 --json";
  all.push_back(
      at_most("preparation, both boundaries", results.fact("prepare_s"), 180.0, "s", prepare));
  all.push_back(at_most("preparation, peak memory", results.fact("prepare_peak_bytes") / kGib, 8.0,
                        "GiB", prepare));
  all.push_back(
      at_most("model file", results.fact("model_file_bytes") / kGib, 1.5, "GiB", prepare));
  all.push_back(at_most("from start of the daemon to ready", results.fact("load_to_ready_s"), 3.0,
                        "s", "brainshiftd serve --model " + folder + "/colin27.h5"));
}

void add_large(const Results& results, const std::string& folder, std::vector<Check>& all) {
  const std::string command = "bench_error_time --sizes 100 --out " + folder;
  double peak = kNone;
  for (std::size_t row = 0; row < results.meshes.rows(); ++row) {
    if (results.meshes.text(row, "mesh") == "100k") {
      peak = results.meshes.number(row, "peak_rss_bytes") / kGib;
    }
  }
  all.push_back(
      at_most("100 thousand nodes, peak memory of preparation", peak, 20.0, "GiB", command));
  const MethodSummary* warm = results.find("100k", "paper", "condensed", "warm");
  Check update{"100 thousand nodes, warm update / t_solve", warm ? warm->over_tsolve : kNone,
               "reported", false, command};
  update.pass = std::isfinite(update.value);
  all.push_back(update);
}

}  // namespace

std::vector<Check> checks(const Results& results, const std::string& folder, bool with_100k) {
  std::vector<Check> all;
  add_updates(results, folder, all);
  add_paper(results, folder, all);
  add_exactness(results, folder, all);
  add_preparation(results, folder, all);
  if (with_100k) add_large(results, folder, all);
  Check coverage{"share of true displacements within the 90 % interval, scenario paper",
                 or_none(run_of(results, "paper").coverage_90), "0.80 to 0.97", false,
                 replay(folder, "paper")};
  coverage.pass = coverage.value >= 0.80 && coverage.value <= 0.97;
  all.push_back(coverage);
  Check growth =
      at_most("growth of the daemon's memory over 10,000 updates",
              (results.fact("rss_after_bytes") - results.fact("rss_before_bytes")) / kMib, 1.0,
              "MiB", replay(folder, "no-contact"));
  growth.pass = growth.pass && results.fact("growth_updates") >= kUpdatesForGrowth;
  all.push_back(growth);
  return all;
}

std::string to_json(const std::vector<Check>& checks, const std::vector<std::string>& left_out) {
  nlohmann::ordered_json json;
  json["checks"] = nlohmann::ordered_json::array();
  for (const Check& check : checks) {
    nlohmann::ordered_json value = nullptr;
    if (std::isfinite(check.value)) value = check.value;
    nlohmann::ordered_json entry = {{"name", check.name}, {"value", value}, {"bound", check.bound}};
    if (check.has_bound) entry["pass"] = check.pass;
    entry["command"] = check.command;
    json["checks"].push_back(std::move(entry));
  }
  json["left_out"] = left_out;
  return json.dump(2) + "\n";
}

}  // namespace brainshift::bench
