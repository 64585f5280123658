// SPDX-License-Identifier: Apache-2.0
#include "common/values/distance_grid.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace brainshift {

Status validate(const DistanceGrid& grid) {
  if (grid.empty() && grid.dims == std::array<int, 3>{0, 0, 0}) return {};
  const auto [n0, n1, n2] = grid.dims;
  const std::string nodes =
      std::to_string(n0) + " x " + std::to_string(n1) + " x " + std::to_string(n2) + " nodes";
  if (std::min({n0, n1, n2}) < 2) return invalid("distance grid: " + nodes + ": at least 2 a side");
  if (grid.values.size() != grid.num_nodes())
    return invalid("distance grid: " + std::to_string(grid.values.size()) + " values for " + nodes);
  if (!(std::isfinite(grid.spacing_mm) && grid.spacing_mm > 0.0))
    return invalid("distance grid: spacing_mm = " + std::to_string(grid.spacing_mm) +
                   ": must be > 0");
  if (!grid.origin_mm.allFinite())
    return fail(ErrorCode::kNotFinite, "distance grid: origin_mm is not finite");
  const auto bad = std::find_if(grid.values.begin(), grid.values.end(),
                                [](float value) { return !std::isfinite(value); });
  if (bad == grid.values.end()) return {};
  return fail(
      ErrorCode::kNotFinite,
      "distance grid: value " + std::to_string(bad - grid.values.begin()) + " is not finite");
}

}  // namespace brainshift
