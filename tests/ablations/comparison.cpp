// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/ablations/comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "common/core/statistics.hpp"
#include "tests/ablations/ablation_truths.hpp"
#include "tests/benchmarks/paired_test.hpp"

namespace brainshift::ablations {
namespace {

using surgeries::Rows;

struct Measure {
  const char* name;
  const char* unit;
  std::function<double(const Rows&, std::size_t)> value;
};

const std::vector<Measure>& measures() {
  const auto column = [](const char* name) {
    return [name](const Rows& rows, std::size_t i) { return rows.number(i, name); };
  };
  static const std::vector<Measure> all = {{"tumour", "mm", column("tumour_mm")},
                                           {"craniotomy", "mm", column("cppd_mm")},
                                           {"brain", "mm", column("field_mm")},
                                           {"interval", "", [](const Rows& rows, std::size_t i) {
                                              return std::abs(rows.number(i, "coverage_90") - 0.9);
                                            }}};
  return all;
}

// Row of each surgery's chosen update: head, patient, truth and seed -> its place in `rows`.
using Updates = std::map<std::string, std::size_t>;

std::string surgery_of(const Rows& rows, std::size_t i) {
  std::string key;
  for (const char* column : {"head", "patient", "truth", "seed"}) {
    key += rows.text(i, column) + ",";
  }
  return key;
}

Updates updates_of(const Rows& rows, bool alone) {
  Updates chosen;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!alone || rows.text(i, "data") == "tumour") chosen[surgery_of(rows, i)] = i;
  }
  return chosen;
}

// Of what has a unit, the logarithms.
struct Pairs {
  std::vector<double> of_default, of_variant;
};

// Below this an error is none.
constexpr double kLeastError_mm = 1e-4;
double compared(double value, const Measure& measure) {
  const bool has_unit = *measure.unit != 0;
  return has_unit ? std::log(std::max(value, kLeastError_mm)) : value;
}

// Values of both, where both have one, by group; kEverything holds them all.
std::map<std::string, Pairs> pairs_of(const Rows& without, const Rows& with, const Measure& measure,
                                      bool alone) {
  const Updates defaults = updates_of(with, alone), variants = updates_of(without, alone);
  std::map<std::string, Pairs> groups;
  for (const auto& [surgery, i] : variants) {
    const auto found = defaults.find(surgery);
    if (found == defaults.end()) continue;
    const double a = measure.value(with, found->second), b = measure.value(without, i);
    if (!std::isfinite(a) || !std::isfinite(b)) continue;
    for (const std::string& group :
         {std::string(kEverything), group_of(without.text(i, "truth"))}) {
      groups[group].of_default.push_back(compared(a, measure));
      groups[group].of_variant.push_back(compared(b, measure));
    }
  }
  return groups;
}

Difference difference_of(const Measure& measure, const Pairs& pairs) {
  Difference difference;
  difference.measure = measure.name;
  difference.unit = measure.unit;
  difference.pairs = static_cast<int>(pairs.of_default.size());
  const bool logs = !difference.unit.empty();
  const auto mean = [logs](const std::vector<double>& values) {
    const double plain = mean_std(values).mean;
    return logs ? std::exp(plain) : plain;
  };
  difference.of_default = mean(pairs.of_default);
  difference.of_variant = mean(pairs.of_variant);
  difference.p = bench::paired_t_test(pairs.of_variant, pairs.of_default).p;
  const double least = difference.unit.empty() ? kLeastCoverage : kLeastChange;
  difference.counts = difference.p < kSignificant && std::abs(difference.change()) > least;
  return difference;
}

}  // namespace

double Difference::change() const {
  const double more = of_variant - of_default;
  return unit.empty() ? more : more / std::max(of_default, 1e-9);
}

std::string text_of(const Difference& difference) {
  return fmt::format("{}, {}, {}: {:.2f} → {:.2f}{}{}", difference.measure, difference.group,
                     difference.data, difference.of_default, difference.of_variant,
                     difference.unit.empty() ? "" : " ", difference.unit);
}

std::vector<Difference> differences(const Rows& rows, const Part& part) {
  const Rows with = rows.where("variant", kDefault);
  const Rows without = rows.where("variant", part.variant.name);
  std::vector<Difference> all;
  for (const bool alone : {true, false}) {
    for (const Measure& measure : measures()) {
      auto groups = pairs_of(without, with, measure, alone);
      for (const std::string& group : group_names()) {
        const Pairs& pairs = groups[group];
        if (pairs.of_default.size() < 2) continue;
        Difference difference = difference_of(measure, pairs);
        difference.group = group;
        difference.data = alone ? "tumour alone" : "all data";
        all.push_back(std::move(difference));
      }
    }
  }
  return all;
}

double median_time_ratio(const Rows& rows, const Part& part) {
  const Rows with = rows.where("variant", kDefault);
  const Rows without = rows.where("variant", part.variant.name);
  std::map<std::string, double> defaults;
  for (std::size_t i = 0; i < with.size(); ++i) {
    defaults[surgery_of(with, i) + with.text(i, "data")] = with.number(i, "update_ms");
  }
  std::vector<double> ratios;
  for (std::size_t i = 0; i < without.size(); ++i) {
    const auto found = defaults.find(surgery_of(without, i) + without.text(i, "data"));
    if (found == defaults.end()) continue;
    const double ratio = without.number(i, "update_ms") / found->second;
    if (std::isfinite(ratio)) ratios.push_back(ratio);
  }
  return percentile(ratios, 50.0);
}

Balance balance(const std::vector<Difference>& differences, const Part& part) {
  Balance balance;
  for (const Difference& difference : differences) {
    if (!difference.counts) continue;
    // Without the part worse, or, where it was added, with it better.
    (difference.worse() != part.added ? balance.buys : balance.costs).push_back(difference);
  }
  for (auto* some : {&balance.buys, &balance.costs}) {
    std::stable_sort(some->begin(), some->end(), [](const auto& a, const auto& b) {
      return std::abs(a.change()) > std::abs(b.change());
    });
  }
  return balance;
}

}  // namespace brainshift::ablations
