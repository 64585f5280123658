// SPDX-License-Identifier: GPL-3.0-or-later
// What published series say of brain shift, as quantiles that the prior is held to: targets.csv.
//
//   place          "cortex": centre of the craniotomy; "tumour": its centroid; "far side": cortex
//                  opposite the craniotomy
//   quantile_pct   5, 50 or 95
//   target_mm      derived from the series that `source` names (docs/decisions/0018); motion by
//                  deformation alone, the error of the head's pose removed
//   low_mm high_mm the bracket that counts as agreement
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::prior_study {

inline constexpr int kPlaces = 3;
inline constexpr std::array<const char*, kPlaces> kPlaceNames = {"cortex", "tumour", "far side"};
inline constexpr std::array<double, 3> kTargetQuantiles = {5.0, 50.0, 95.0};

struct Target {
  int place = 0;  // index into kPlaceNames
  double quantile_pct = 50.0;
  double target_mm = 0.0, low_mm = 0.0, high_mm = 0.0;
  std::string source;

  bool holds(double motion_mm) const { return motion_mm >= low_mm && motion_mm <= high_mm; }
};

// Every place and quantile once, in any order. kUnreadable names line and column: an unknown place
// or quantile, a pair that comes twice or is missing, no source, or not 0 <= low <= target <= high.
Result<std::vector<Target>> parse_targets(std::string_view text, const std::string& origin);
Result<std::vector<Target>> read_targets(const std::filesystem::path& path);  // kNotFound too

// nullptr where there is none.
const Target* find_target(const std::vector<Target>& targets, int place, double quantile_pct);

}  // namespace brainshift::prior_study
