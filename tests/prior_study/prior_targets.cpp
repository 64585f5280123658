// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/prior_study/prior_targets.hpp"

#include <algorithm>

#include "common/io/files/file_access.hpp"
#include "tests/benchmarks/csv_table.hpp"

namespace brainshift::prior_study {
namespace {

template <typename Values, typename Value>
int index_in(const Values& values, const Value& value) {
  const auto found = std::find(values.begin(), values.end(), value);
  return found == values.end() ? -1 : static_cast<int>(found - values.begin());
}

}  // namespace

const Target* find_target(const std::vector<Target>& targets, int place, double quantile_pct) {
  for (const Target& target : targets) {
    if (target.place == place && target.quantile_pct == quantile_pct) return &target;
  }
  return nullptr;
}

Result<std::vector<Target>> parse_targets(std::string_view text, const std::string& origin) {
  const auto table = bench::CsvTable::parse(text, origin);
  if (!table) return tl::unexpected(table.error());
  std::vector<Target> targets;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const auto wrong = [&](const std::string& what) {
      return fail(ErrorCode::kUnreadable,
                  origin + ": line " + std::to_string(row + 2) + ": " + what);
    };
    Target target;
    target.place = index_in(kPlaceNames, table->text(row, "place"));
    if (target.place < 0) return wrong("place \"" + table->text(row, "place") + "\" is unknown");
    target.quantile_pct = table->number(row, "quantile_pct");
    if (index_in(kTargetQuantiles, target.quantile_pct) < 0) {
      return wrong("quantile_pct is not 5, 50 or 95");
    }
    target.target_mm = table->number(row, "target_mm");
    target.low_mm = table->number(row, "low_mm");
    target.high_mm = table->number(row, "high_mm");
    const bool ordered = target.low_mm >= 0.0 && target.low_mm <= target.target_mm &&
                         target.target_mm <= target.high_mm;
    if (!ordered) return wrong("must be 0 <= low_mm <= target_mm <= high_mm");
    target.source = table->text(row, "source");
    if (target.source.empty()) return wrong("source is missing");
    if (find_target(targets, target.place, target.quantile_pct) != nullptr) {
      return wrong("place and quantile_pct stand in an earlier line too");
    }
    targets.push_back(std::move(target));
  }
  for (int place = 0; place < kPlaces; ++place) {
    for (const double quantile : kTargetQuantiles) {
      if (find_target(targets, place, quantile) != nullptr) continue;
      return fail(ErrorCode::kUnreadable, origin + ": no target for " +
                                              kPlaceNames[static_cast<std::size_t>(place)] +
                                              ", quantile_pct " + bench::csv_number(quantile));
    }
  }
  return targets;
}

Result<std::vector<Target>> read_targets(const std::filesystem::path& path) {
  const auto text = io::read_file(path);
  if (!text) return tl::unexpected(text.error());
  return parse_targets(*text, path.string());
}

}  // namespace brainshift::prior_study
