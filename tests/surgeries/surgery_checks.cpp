// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/surgery_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/core/statistics.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift::surgeries {
namespace {

using test_support::record_check;
using test_support::record_figure;
using test_support::record_left_out;

// Decrement of contact by descent, in posterior standard deviations, and depth of an open slave.
constexpr double kLargestDecrement = 1e-3;
constexpr double kLargestViolation_mm = 0.01;

class HeadChecks {
 public:
  HeadChecks(const Rows& all, const std::optional<Rows>& before)
      : all_(all), last_(all.last_updates()), before_(before), head_(all.text(0, "head")) {}

  void run() {
    for (const std::string& scenario : all_.values("scenario")) {
      tumour(scenario);
      nowhere_worse(scenario);
      coverage(scenario);
      joint(scenario);
      sag(scenario);
    }
    single_coverage();
    contradictions();
    inverted();
    contact();
    warm_and_cold();
    time();
    verdicts();
  }

 private:
  void check(const std::string& name, double value, const std::string& bound, bool pass) {
    record_check(head_, name, value, bound, pass, source());
  }
  std::string source() const { return fmt::format("twin; {} surgeries", last_.size()); }
  Rows of(const Rows& rows, const std::string& scenario) const {
    return rows.where("scenario", scenario);
  }

  void tumour(const std::string& scenario) {
    const Rows rows = of(last_, scenario);
    const auto n = static_cast<double>(rows.size());
    double recovered = 0.0;
    for (const double one : rows.numbers("recovered_pct")) recovered += one / n;
    const double error = rows.mean("tumour_mm");
    const bool none_refused = rows.numbers("tumour_mm").size() == rows.size();
    check(fmt::format("{}: tumour recovered %", scenario), recovered,
          fmt::format(">= 95 or error <= 0.15 mm (error {:.3f} mm; aim 97)", error),
          recovered >= 95.0 || (none_refused && error <= 0.15));
  }

  void nowhere_worse(const std::string& scenario) {
    const Rows rows = of(all_, scenario);
    const int worse = rows.count("worse_nodes", [](double n) { return n > 0.0; });
    check(fmt::format("{}: updates somewhere worse than no correction by more than their interval",
                      scenario),
          worse,
          fmt::format("0 of {} (worst by {:.2f} mm)", rows.size(), rows.largest("worst_excess_mm")),
          worse == 0);
  }

  void coverage(const std::string& scenario) {
    const Rows rows = of(last_, scenario);
    double mean = 0.0;
    for (const double one : rows.numbers("coverage_90")) {
      mean += one / static_cast<double>(rows.size());
    }
    check(fmt::format("{}: coverage of the 90 % interval", scenario), mean,
          "0.80 to 0.97 (aim 0.85 to 0.95)", mean >= 0.80 && mean <= 0.97);
  }

  // All sources against the tumour alone: ours, or that of the estimate before where it is better.
  void joint(const std::string& scenario) {
    const Rows rows = of(all_, scenario);
    const Rows joint = rows.where("stage", "tumour+cortex+tracks");
    if (joint.empty()) return;
    for (const auto& [column, what] : {std::pair{"craniotomy_mm", "by displacement"},
                                       std::pair{"craniotomy_closest_mm", "by closest point"}}) {
      double alone = rows.where("stage", "tumour").mean(column);
      if (before_) {
        const double earlier = of(*before_, scenario).where("stage", "tumour").mean(column);
        if (std::isfinite(earlier)) alone = std::min(alone, earlier);
      }
      const double ratio = joint.mean(column) / alone;
      check(fmt::format("{}: craniotomy error {} over that of the tumour alone", scenario, what),
            ratio, fmt::format("<= 0.5 ({:.3f} to {:.3f} mm)", alone, joint.mean(column)),
            ratio <= 0.5);
    }
  }

  // Where nothing swells, shrinks or is missing.
  void sag(const std::string& scenario) {
    const Rows now = of(last_, scenario);
    const bool changes =
        now.largest("swelling_strain") > 0.0 || now.largest("removed_nodes") > 0.0 ||
        now.count("volume_strain", [](double strain) { return strain != 0.0; }) > 0;
    if (changes) return;
    if (!before_) {
      record_left_out(head_, scenario + ": sag against the estimate before: no --before given");
      return;
    }
    const Rows earlier = of(before_->last_updates(), scenario);
    if (!same_surgeries(now, earlier)) {
      record_left_out(head_, scenario + ": sag against the estimate before: other surgeries");
      return;
    }
    for (const auto& [column, what] :
         {std::pair{"tumour_mm", "tumour"}, std::pair{"field_mean_mm", "field"}}) {
      const double ratio = now.mean(column) / earlier.mean(column);
      check(fmt::format("{}: {} error over that of the estimate before", scenario, what), ratio,
            fmt::format("<= 1.15 (aim 1; {:.3f} to {:.3f} mm)", earlier.mean(column),
                        now.mean(column)),
            ratio <= 1.15);
    }
  }

  static bool same_surgeries(const Rows& a, const Rows& b) {
    const auto keys = [](const Rows& rows) {
      std::vector<std::string> all;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        all.push_back(rows.text(i, "place") + "/" + rows.text(i, "seed") + "/" +
                      rows.text(i, "nodes"));
      }
      std::sort(all.begin(), all.end());
      return all;
    };
    return keys(a) == keys(b);
  }

  void single_coverage() {
    const auto n = static_cast<double>(last_.size());
    const int covered = last_.count("coverage_90", [](double c) { return c >= 0.6; });
    const double share = 100.0 * (n - covered) / n;
    check("share of single surgeries with coverage below 0.6 %", share, "<= 5 (aim 0)",
          share <= 5.0);
  }

  void contradictions() {
    const Rows rows =
        all_.where([](const Rows& all, std::size_t i) { return all.number(i, "sources") > 1.0; });
    if (rows.empty()) return;
    const int said = rows.count("contradictions", [](double n) { return n > 0.0; });
    const double share = 100.0 * said / static_cast<double>(rows.size());
    check("updates that call consistent sources contradictory %", share, "<= 1", share <= 1.0);
  }

  void inverted() {
    const Rows good = all_.where("quality", "good");
    const int fields = good.count("inverted", [](double n) { return n > 0.0; });
    check("fields of quality good with inverted elements", fields,
          fmt::format("0 of {}", good.size()), fields == 0);
  }

  void contact() {
    const auto published = all_.numbers("contact_decrement").size();
    if (published == 0) {
      record_left_out(head_, "contact certificate: the estimate publishes none");
      return;
    }
    const auto updates = all_.where("status", "converged").size();
    const int met =
        static_cast<int>(all_.where([](const Rows& all, std::size_t i) {
                               return all.number(i, "contact_decrement") <= kLargestDecrement &&
                                      all.number(i, "contact_violation_mm") <= kLargestViolation_mm;
                             })
                             .size());
    const auto without = static_cast<double>(all_.size()) - met;
    check("updates without the contact certificate", without,
          fmt::format("0 (decrement <= {:g} and violation <= {:g} mm; largest {:.2g} and {:.2g}; "
                      "{} of {} updates converged)",
                      kLargestDecrement, kLargestViolation_mm, all_.largest("contact_decrement"),
                      all_.largest("contact_violation_mm"), updates, all_.size()),
          without == 0.0);
  }

  void warm_and_cold() {
    const double largest = last_.largest("warm_cold_mm");
    check("warm against cold mm: largest of any node and surgery", largest, "<= 0.01",
          largest <= 0.01);
  }

  void time() {
    const Rows rows = all_.where("stage", "tumour+cortex+tracks");
    std::vector<double> ratios;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double ratio = rows.number(i, "update_ms") / rows.number(i, "t_solve_ms");
      if (std::isfinite(ratio)) ratios.push_back(ratio);
    }
    if (ratios.empty()) return;
    const double p50 = percentile(ratios, 50);
    check("update with three sources over one solve: p50", p50,
          fmt::format("<= 2 (aim 1; p95 {:.2f}; {} nodes)", percentile(ratios, 95),
                      rows.text(0, "nodes")),
          p50 <= 2.0);
  }

  void verdicts() {
    for (const char* quality : {"good", "caution", "unusable"}) {
      record_figure(head_, fmt::format("updates of quality {}", quality),
                    static_cast<double>(all_.where("quality", quality).size()),
                    fmt::format("shown; of {}", all_.size()), source());
    }
    record_figure(head_, "updates that were refused",
                  static_cast<double>(all_.where("status", "refused").size()), "shown", source());
  }

  const Rows& all_;
  Rows last_;
  const std::optional<Rows>& before_;
  std::string head_;
};

}  // namespace

void check_head(const Rows& head, const std::optional<Rows>& before) {
  HeadChecks(head, before).run();
}

}  // namespace brainshift::surgeries
