// SPDX-License-Identifier: GPL-3.0-or-later
// Quantiles of drawn motion: a table, checks against the published targets, and figures without a
// bound.
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "common/core/error.hpp"
#include "tests/prior_study/prior_draws.hpp"
#include "tests/prior_study/prior_targets.hpp"

namespace brainshift::prior_study {

inline constexpr std::array<double, 5> kQuantiles = {5.0, 25.0, 50.0, 75.0, 95.0};

// quantiles.csv; a row per part and place. Targets stand beside the total alone.
inline constexpr const char* kQuantileHeading =
    "part,place,draws,unsettled,q5_mm,q25_mm,q50_mm,q75_mm,q95_mm,target_q5_mm,target_q50_mm,"
    "target_q95_mm,bracket_q5_mm,bracket_q50_mm,bracket_q95_mm,source";
Status write_quantiles(const std::filesystem::path& path, const std::vector<PartDraws>& all,
                       const std::vector<Target>& targets);

// Records a check per target: is the quantile of the first of `all` inside its bracket? True when
// every one is. A place without draws has no quantile and fails.
bool check_quantiles(const std::vector<PartDraws>& all, const std::vector<Target>& targets);

// Share of draws whose smallest det F is at most `ratio`. NaN without draws.
double share_at_most(const std::vector<double>& min_volume_ratio, double ratio);

// Correlation of two samples of one size (Pearson). NaN where one of them does not vary.
double correlation(const std::vector<double>& a, const std::vector<double>& b);

// Records, without a bound: inverted elements, motion outwards at the cortex, the correlation of
// cortex and tumour, the far side's motion against the cortex's, and draws without a contact set.
void record_figures(const PartDraws& total);

}  // namespace brainshift::prior_study
