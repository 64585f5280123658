// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/bench_checks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/core/statistics.hpp"

namespace brainshift::bench {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kGib = 1024.0 * 1024.0 * 1024.0;
constexpr double kMib = 1024.0 * 1024.0;
constexpr int kManyActive = 500;
constexpr int kUpdatesForTail = 2000;
constexpr int kUpdatesForGrowth = 10000;
constexpr int kSurgeries = 20;  // of a paired test

double or_none(const std::optional<double>& value) { return value.value_or(kNone); }

const client::RunReport& run_of(const Results& results, const std::string& name) {
  static const client::RunReport none;
  const auto found = results.runs.find(name);
  return found == results.runs.end() ? none : found->second;
}

double p50_over_tsolve(const client::RunReport& run) {
  return run.latency_ms ? run.latency_ms->p50 / or_none(run.full_solve_ms) : kNone;
}

bool has_contact(const client::RunReport& run) { return run.contact && run.contact->active > 0; }

Check at_most(std::string name, double value, double bound, const std::string& unit,
              std::string command) {
  return {std::move(name), value, "<= " + csv_number(bound) + (unit.empty() ? "" : " " + unit),
          value <= bound, std::move(command)};
}

std::string replay(const std::string& folder, const std::string& name) {
  return "brainshift replay " + folder + "/" + name +
         ".surgery --boundary contact, see cmake/scripts/bench.sh";
}

// suffix: "" or "@KERNEL".
void add_updates(const Results& results, const std::string& folder, const std::string& suffix,
                 std::vector<Check>& all) {
  const std::string kernel = suffix.empty() ? "" : ", BLAS kernel " + suffix.substr(1);
  const auto median = [&](const std::string& what, const std::string& name, double bound,
                          bool contact) {
    const client::RunReport& run = run_of(results, name + suffix);
    Check check = at_most(what + ", p50 / t_solve" + kernel, p50_over_tsolve(run), bound, "",
                          replay(folder, name));
    check.pass = check.pass && has_contact(run) == contact;
    all.push_back(std::move(check));
  };
  median("warm update with contact", "sag-progress", 0.45, true);
  median("the same, region of 40 mm about the tumour", "region", 0.3, true);
  const Results::FirstUpdates first = results.first_updates(suffix);
  Check cold =
      at_most("first update of a session, more than 500 slaves press, median / t_solve" + kernel,
              first.over_tsolve.empty() ? kNone : percentile(first.over_tsolve, 50.0), 1.5, "",
              replay(folder, "cold"));
  cold.pass = cold.pass && first.active > kManyActive;
  all.push_back(std::move(cold));
  median("update without contact", "no-contact", 0.2, false);
  median("three sources, warm", "joint-sag", 1.0, true);
}

void add_tail(const Results& results, const std::string& folder, std::vector<Check>& all) {
  Check tail{"p99 over 2,000 different updates / p50", kNone, "<= 2.5", false,
             replay(folder, "sag-progress")};
  const auto latency = results.latency_ms.find("sag-progress");
  if (latency != results.latency_ms.end()) {
    tail.value = percentile(latency->second, 99.0) / percentile(latency->second, 50.0);
    // The first update of the session is not among them.
    tail.pass =
        tail.value <= 2.5 && static_cast<int>(latency->second.size()) + 1 >= kUpdatesForTail;
  }
  all.push_back(std::move(tail));
}

std::string differs(const PairedTest& test) {
  return csv_number(test.mean, 2) + " mm (p = " + csv_number(test.p, 2) + ")";
}

// The paper's method and its faster form give the same estimates; the faster one inverts twenty
// surgeries on the small mesh, and errors are compared with it.
void add_paper(const Results& results, const std::string& folder, const char* method, double bound,
               const std::string& prior, std::vector<Check>& all) {
  const std::string whose = prior == "paper" ? "the paper's prior" : "the case's prior";
  Check check{
      std::string(method) + ", " + whose + " / condensed, both cold, time; error not larger", kNone,
      ">= " + csv_number(bound), false,
      "bench_error_time --sizes 5,18 --scenarios paper --out " + folder};
  const auto find = [&](const char* mesh, const char* which, const std::string& own) {
    return results.find(mesh, "paper", which, "cold", Results::kLargestRank, own);
  };
  const MethodSummary* slow = find("18k", method, prior);
  const MethodSummary* ours = find("18k", "condensed", "case");
  const MethodSummary* small_slow = find("5k", "paper-woodbury", prior);
  const MethodSummary* small_ours = find("5k", "condensed", "case");
  if (slow != nullptr && ours != nullptr) check.value = slow->p50_ms / ours->p50_ms;
  if (small_slow != nullptr && small_ours != nullptr) {
    const PairedErrors errors = paired_errors(results.error_time, *small_slow, *small_ours);
    check.name += ": by " + differs(errors.tumour) + " at the tumour, " + differs(errors.field) +
                  " in the field, over " + std::to_string(errors.tumour.pairs) +
                  " surgeries on 5 thousand nodes";
    check.pass = check.value >= bound && errors.tumour.pairs >= kSurgeries &&
                 errors.field.pairs >= kSurgeries && errors.tumour.mean <= 0.0 &&
                 errors.field.mean <= 0.0;
  }
  all.push_back(std::move(check));
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
  const std::string serve = "brainshiftd serve --model " + folder + "/colin27.h5";
  all.push_back(
      at_most("preparation, both boundaries", results.fact("prepare_s"), 25.0, "s", prepare));
  all.push_back(at_most("preparation, peak memory", results.fact("prepare_peak_bytes") / kGib, 8.0,
                        "GiB", prepare));
  all.push_back(
      at_most("model file", results.fact("model_file_bytes") / kMib, 300.0, "MiB", prepare));
  all.push_back(at_most("daemon with a session, resident memory",
                        results.fact("rss_session_bytes") / kMib, 400.0, "MiB", serve));
  all.push_back(at_most("from start of the daemon to ready", results.fact("load_to_ready_s"), 0.5,
                        "s", serve));
}

void add_large(const Results& results, const std::string& folder, std::vector<Check>& all) {
  const std::string prepare =
      "brainshiftd prepare --case " + folder + "/large.yaml --out " + folder + "/large.h5 --json";
  const std::string large = "100 thousand nodes, ";
  all.push_back(at_most(large + "peak memory of preparation",
                        results.fact("large_peak_bytes") / kGib, 8.0, "GiB", prepare));
  all.push_back(at_most(large + "preparation, both boundaries", results.fact("large_prepare_s"),
                        300.0, "s", prepare));
  const MethodSummary* warm = results.find("100k", "paper", "condensed", "warm");
  all.push_back(at_most(large + "warm update / t_solve", warm ? warm->over_tsolve : kNone, 0.4, "",
                        "bench_error_time --sizes 100 --out " + folder));
}

// What a part that is left out truly changes, beyond what the update says of it.
void add_scenes(const Results& results, const std::string& folder, std::vector<Check>& all) {
  Check check{"what leaving out a part changes / its estimate, largest (changes above 0.01 mm)",
              kNone, "<= 1", false, "bench_scenes --csv " + folder + "/scenes.csv"};
  const CsvTable& scenes = results.scenes;
  for (std::size_t row = 0; row < scenes.rows(); ++row) {
    const double change = scenes.number(row, "difference_mm");
    const double ratio = change > 0.01 ? change / scenes.number(row, "estimate_mm") : 0.0;
    if (!(ratio <= check.value)) check.value = ratio;
  }
  check.pass = check.value <= 1.0;
  all.push_back(std::move(check));
}

void add_coverage(const Results& results, const std::string& folder, std::vector<Check>& all) {
  const MethodSummary* ours = results.find("18k", "paper", "condensed", "cold");
  Check check{"share of true displacements within the 90 % interval, scenario paper, mean",
              ours != nullptr ? ours->own_coverage_90 : kNone, "0.80 to 0.97", false,
              "bench_error_time --sizes 18 --scenarios paper --out " + folder};
  check.pass = check.value >= 0.80 && check.value <= 0.97;
  all.push_back(std::move(check));
}

bool leaves_out_100k(const Results& results) {
  return std::any_of(results.left_out.begin(), results.left_out.end(), [](const auto& line) {
    return line.find("100 thousand nodes") != std::string::npos;
  });
}

}  // namespace

std::vector<Check> checks(const Results& results, const std::string& folder) {
  std::vector<Check> all;
  for (const char* suffix : {"", "@Haswell"}) add_updates(results, folder, suffix, all);
  add_tail(results, folder, all);
  for (const char* prior : {"case", "paper"}) {
    add_paper(results, folder, "paper", 700.0, prior, all);
    add_paper(results, folder, "paper-woodbury", 200.0, prior, all);
  }
  add_exactness(results, folder, all);
  add_preparation(results, folder, all);
  if (!leaves_out_100k(results)) add_large(results, folder, all);
  add_scenes(results, folder, all);
  add_coverage(results, folder, all);
  Check growth =
      at_most("growth of the daemon's memory over 10,000 updates",
              (results.fact("rss_after_bytes") - results.fact("rss_before_bytes")) / kMib, 0.0,
              "MiB", replay(folder, "no-contact"));
  growth.pass = growth.pass && results.fact("growth_updates") >= kUpdatesForGrowth;
  all.push_back(std::move(growth));
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
