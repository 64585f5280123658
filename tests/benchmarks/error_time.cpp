// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/benchmarks/error_time.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <limits>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "client/tools/replay/score.hpp"
#include "client/tools/twin/surgery.hpp"
#include "common/contact/forward_model.hpp"
#include "common/core/stopwatch.hpp"
#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/inversion/inverter.hpp"
#include "tests/simulation/variation.hpp"

namespace brainshift::bench {
namespace {

// Every method weighs them alike, as the daemon does for the condensed one.
SparseData sparse_data(const LandmarkPairs& pairs, const CaseConfig& config) {
  const double sd_mm = std::max(pairs.sd_mm, config.inversion.sigma_mm);
  return {pairs.undeformed, pairs.deformed - pairs.undeformed,
          VecX::Constant(pairs.undeformed.cols(), sd_mm)};
}

// Requests a stop when the time is up, or not at all when destroyed before.
class Alarm {
 public:
  explicit Alarm(double seconds)
      : thread_([this, seconds](const std::stop_token& cancelled) {
          std::unique_lock lock(mutex_);
          std::condition_variable_any wake;
          wake.wait_for(lock, cancelled, std::chrono::duration<double>(seconds),
                        [] { return false; });
          if (!cancelled.stop_requested()) source_.request_stop();
        }) {}
  std::stop_token token() const { return source_.get_token(); }
  bool rang() const { return source_.stop_requested(); }

 private:
  std::mutex mutex_;
  std::stop_source source_;
  std::jthread thread_;  // last: it uses the others
};

struct Row {
  Method method = Method::kCondensed;
  const char* prior = "case";
  int rank = 0;  // 0: not applicable
  const char* start = "cold";
  int repetition = 1;
  double time_ms = 0.0, t_solve_ms = 0.0;
  std::string status;
};

std::vector<std::string> lead(const Head& head, const Trial& trial, const Row& row) {
  return {head.name,
          std::to_string(head.model->mesh.num_nodes()),
          trial.scenario,
          std::string(to_string(row.method)),
          row.prior,
          row.rank > 0 ? std::to_string(row.rank) : "",
          row.start,
          std::to_string(row.repetition),
          csv_number(row.time_ms),
          csv_number(row.time_ms / row.t_solve_ms)};
}

Status write_estimate(const Head& head, const Trial& trial, const Row& row,
                      const Estimate& estimate, CsvWriter& out) {
  const auto& truth = trial.surgeries[static_cast<std::size_t>(row.repetition - 1)].truth;
  client::RunReport report;
  if (Status ok = client::score(*head.model, truth, estimate, report); !ok) return ok;
  const VecX field_mm = (estimate.displacement - truth.displacement).colwise().norm().transpose();
  const auto optional = [](const std::optional<double>& value) {
    return value ? csv_number(*value) : std::string();
  };
  auto cells = lead(head, trial, row);
  cells.insert(cells.end(),
               {report.error_mm.cross ? csv_number(report.error_mm.cross->mean) : std::string(),
                csv_number(field_mm.mean()), csv_number(field_mm.maxCoeff()),
                optional(report.recovery_pct), std::to_string(estimate.contact.active),
                std::to_string(estimate.history.size()), std::string(to_string(estimate.status)),
                optional(report.coverage_90), csv_number(row.t_solve_ms)});
  return out.row(cells);
}

Status write_failure(const Head& head, const Trial& trial, const Row& row, CsvWriter& out) {
  auto cells = lead(head, trial, row);
  cells.insert(cells.end(), {"", "", "", "", "", "", row.status, "", csv_number(row.t_solve_ms)});
  return out.row(cells);
}

}  // namespace

Result<Trial> make_trial(const Head& head, const client::Scenario& scenario, int repetitions,
                         std::uint64_t seed, const Progress& progress) {
  client::Scenario first = scenario;
  first.fluid_levels_mm.resize(1);
  Trial trial;
  trial.scenario = scenario.name;
  for (int r = 0; r < repetitions; ++r) {
    report(progress, "truths of " + scenario.name, static_cast<double>(r) / repetitions);
    const std::uint64_t own = seed + static_cast<std::uint64_t>(r);
    auto surgery = client::play_scenario(*head.model, head.config, head.prepared->forward(),
                                         client::vary(first, own), own);
    if (!surgery) return tl::unexpected(surgery.error());
    const auto* pairs = std::get_if<LandmarkPairs>(&surgery->observations.front().body);
    if (pairs == nullptr) {
      return invalid("scenario " + scenario.name + ": measures no displacements; choose another");
    }
    trial.surgeries.push_back(
        {std::move(surgery->truths.front()), sparse_data(*pairs, head.config)});
  }
  return trial;
}

Result<Prior> papers_prior(const Head& head) {
  constexpr double kTissueInAir_n_m3 = 9800.0;
  CaseConfig config = head.config;
  PriorConfig& prior = config.prior;
  prior.force_density_sd_n_m3 = kTissueInAir_n_m3;
  for (double* other :
       {&prior.medium_density_sd_n_m3, &prior.coarse_density_sd_n_m3, &prior.gravity_mode_sd,
        &prior.tumour_volume_strain_sd, &prior.brain_volume_strain_sd, &prior.resection_weight_sd,
        &prior.resection_stress_sd_pa, &prior.opening_pressure_sd_pa, &prior.gravity_sides_sd,
        &prior.gravity_ends_sd, &prior.ventricle_volume_strain_sd, &prior.tract_pressure_sd_pa,
        &prior.broad_weight}) {
    *other = 0.0;
  }
  auto prepared = inversion::PreparedModel::prepare(head.model, config, Boundary::kContact);
  if (!prepared) return tl::unexpected(prepared.error());
  return Prior{"paper", std::make_shared<const inversion::PreparedModel>(std::move(*prepared))};
}

Status run_condensed(const Head& head, const Trial& trial, int rank, CsvWriter& out) {
  inversion::CondensedOptions options;
  options.rank = rank;
  auto inverter =
      inversion::CondensedInverter::build(head.operators, head.locator, head.config, options);
  if (!inverter) return tl::unexpected(inverter.error());
  Row row;
  row.rank = rank;
  row.t_solve_ms = contact::measure_full_solve_ms(head.prepared->forward());
  Estimate estimate;
  // Memory is claimed and caches are filled by an update that does not count.
  if (Status ok = inverter->update(trial.surgeries.back().data, estimate); !ok) return ok;
  for (const char* start : {"cold", "warm"}) {
    row.start = start;
    row.repetition = 0;
    for (const PlayedSurgery& surgery : trial.surgeries) {
      ++row.repetition;
      const Stopwatch watch;
      const Status updated = inverter->update(surgery.data, estimate);
      row.time_ms = watch.milliseconds();
      if (updated) {
        if (Status ok = write_estimate(head, trial, row, estimate, out); !ok) return ok;
      } else {
        row.status = to_string(updated.error().code);
        if (Status ok = write_failure(head, trial, row, out); !ok) return ok;
      }
    }
  }
  return {};
}

Status run_method(const Head& head, const Trial& trial, Method method, const Prior& prior,
                  int repetitions, double budget_s, CsvWriter& out) {
  Row row;
  row.method = method;
  row.prior = prior.name;
  row.t_solve_ms = contact::measure_full_solve_ms(prior.prepared->forward());
  const Stopwatch all;
  for (int r = 0; r < repetitions && r < static_cast<int>(trial.surgeries.size()); ++r) {
    const double left_s = budget_s - all.seconds();
    if (left_s <= 0.0) break;
    const Alarm alarm(left_s);
    inversion::InversionOptions options;
    options.stop = alarm.token();
    row.repetition = r + 1;
    const Stopwatch watch;
    const auto estimate = inversion::invert(
        *prior.prepared, trial.surgeries[static_cast<std::size_t>(r)].data, method, options);
    row.time_ms = watch.milliseconds();
    if (estimate) {
      if (Status ok = write_estimate(head, trial, row, *estimate, out); !ok) return ok;
      continue;
    }
    const bool missing =
        estimate.error().code == ErrorCode::kInternal;  // "unknown inversion method"
    std::fprintf(stderr, "  %s %s: %s: %s\n", head.name.c_str(), trial.scenario.c_str(),
                 std::string(to_string(method)).c_str(), estimate.error().message.c_str());
    row.status = missing        ? "not_available"
                 : alarm.rang() ? "stopped"
                                : to_string(estimate.error().code);
    if (missing) row.time_ms = std::numeric_limits<double>::quiet_NaN();
    return write_failure(head, trial, row, out);
  }
  return {};
}

}  // namespace brainshift::bench
