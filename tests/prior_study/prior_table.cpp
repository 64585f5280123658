// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/prior_study/prior_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/statistics.hpp"
#include "tests/benchmarks/csv_table.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift::prior_study {
namespace {

using bench::csv_number;

constexpr const char* kStudy = "prior-predictive";
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string bracket_of(const Target& target) {
  return csv_number(target.low_mm, 3) + " to " + csv_number(target.high_mm, 3);
}

// Target, bracket and source cells; empty ones for a part alone.
void add_targets(std::vector<std::string>& cells, const std::vector<Target>& targets, int place,
                 bool total) {
  std::vector<std::string> values, brackets;
  std::string source;
  for (const double quantile : kTargetQuantiles) {
    const Target* target = total ? find_target(targets, place, quantile) : nullptr;
    values.push_back(target ? csv_number(target->target_mm, 3) : "");
    brackets.push_back(target ? bracket_of(*target) : "");
    if (target) source = target->source;
  }
  cells.insert(cells.end(), values.begin(), values.end());
  cells.insert(cells.end(), brackets.begin(), brackets.end());
  cells.push_back(source);
}

}  // namespace

Status write_quantiles(const std::filesystem::path& path, const std::vector<PartDraws>& all,
                       const std::vector<Target>& targets) {
  auto table = bench::CsvWriter::create(path, kQuantileHeading);
  if (!table) return tl::unexpected(table.error());
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (int place = 0; place < kPlaces; ++place) {
      const auto p = static_cast<std::size_t>(place);
      const std::vector<double>& motion = all[i].motion_mm[p];
      std::vector<std::string> cells = {all[i].part, kPlaceNames[p], std::to_string(motion.size()),
                                        std::to_string(all[i].unsettled)};
      for (const double q : kQuantiles) cells.push_back(csv_number(percentile(motion, q), 4));
      add_targets(cells, targets, place, i == 0);
      if (Status ok = table->row(cells); !ok) return ok;
    }
  }
  return {};
}

bool check_quantiles(const std::vector<PartDraws>& all, const std::vector<Target>& targets) {
  bool every = true;
  for (const Target& target : targets) {
    const auto p = static_cast<std::size_t>(target.place);
    const double value = percentile(all.front().motion_mm[p], target.quantile_pct);
    const bool pass = target.holds(value);
    every &= test_support::record_check(
        kStudy, fmt::format("{} {} % quantile mm", kPlaceNames[p], target.quantile_pct), value,
        bracket_of(target) + " mm", pass, target.source);
  }
  return every;
}

double share_at_most(const std::vector<double>& min_volume_ratio, double ratio) {
  if (min_volume_ratio.empty()) return kNan;
  const auto below = std::count_if(min_volume_ratio.begin(), min_volume_ratio.end(),
                                   [&](double value) { return !(value > ratio); });
  return static_cast<double>(below) / static_cast<double>(min_volume_ratio.size());
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const MeanStd of_a = mean_std(a), of_b = mean_std(b);
  if (a.size() < 2 || of_a.std == 0.0 || of_b.std == 0.0) return kNan;
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - of_a.mean) * (b[i] - of_b.mean);
  return sum / (static_cast<double>(a.size() - 1) * of_a.std * of_b.std);
}

void record_figures(const PartDraws& total) {
  const auto figure = [](const std::string& name, double value, const std::string& note) {
    test_support::record_figure(kStudy, name, value, note, "");
  };
  figure("draws with inverted elements %", 100.0 * share_at_most(total.min_volume_ratio, 0.0),
         "det F <= 0");
  figure("draws with det F of 0.5 or less %", 100.0 * share_at_most(total.min_volume_ratio, 0.5),
         "bound of an unusable field (decision 0019)");
  const MeanStd outward = mean_std(total.outward_mm);
  figure("mean of the cortex's outward motion mm", outward.mean, "derived: 0 to -2");
  figure("sd of the cortex's outward motion mm", outward.std, "derived: 4.5 to 5");
  const auto& [cortex, tumour, far] = total.motion_mm;
  figure("correlation of cortex and tumour", correlation(cortex, tumour), "judgement: 0.3 to 0.7");
  std::vector<double> ratios;
  for (std::size_t i = 0; i < cortex.size(); ++i) ratios.push_back(far[i] / cortex[i]);
  figure("median of far side over cortex", percentile(ratios, 50.0), "judgement: below 0.25");
  figure("draws whose contact did not settle", total.unsettled, "left out");
}

}  // namespace brainshift::prior_study
