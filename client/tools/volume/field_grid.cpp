// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/volume/field_grid.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace brainshift::client {
namespace {

constexpr double kMaxMargin_mm = 1000.0;
constexpr double kMinSpacing_mm = 0.1;
constexpr double kMaxSpacing_mm = 100.0;
// A box that is a whole number of voxels wide is not one voxel wider for its rounding errors.
constexpr double kRounding = 1e-9;

Status check_range(const char* name, double value, double least, double most) {
  if (value >= least && value <= most) return {};
  return invalid(fmt::format("{} = {}: must be in [{}, {}]", name, value, least, most));
}

}  // namespace

Status validate(const FieldGrid& grid) {
  if (!grid.origin_mm.allFinite() || !std::isfinite(grid.spacing_mm)) {
    return fail(ErrorCode::kNotFinite, "grid: origin and spacing must be numbers");
  }
  if (!(grid.spacing_mm > 0.0)) {
    return invalid(fmt::format("grid.spacing_mm = {}: must be above 0", grid.spacing_mm));
  }
  for (const int count : grid.dims) {
    if (count >= 3 && count <= FieldGrid::kMaxVoxelsAlongAxis) continue;
    return invalid(fmt::format("grid of {} x {} x {} voxels: must have 3 to {} along every axis",
                               grid.dims[0], grid.dims[1], grid.dims[2],
                               FieldGrid::kMaxVoxelsAlongAxis));
  }
  if (grid.num_voxels() > FieldGrid::kMaxVoxels) {
    return invalid(fmt::format(
        "grid of {} x {} x {} voxels, {} mm apart: must have at most {} in all", grid.dims[0],
        grid.dims[1], grid.dims[2], grid.spacing_mm, FieldGrid::kMaxVoxels));
  }
  return {};
}

Result<FieldGrid> grid_around(const Points& points, double margin_mm, double spacing_mm) {
  if (points.cols() == 0) return fail(ErrorCode::kEmptySet, "grid: there is no point to hold");
  if (!points.allFinite()) return fail(ErrorCode::kNotFinite, "grid: a point is not finite");
  Status ok = check_range("grid margin in mm", margin_mm, 0.0, kMaxMargin_mm);
  if (ok) ok = check_range("grid spacing in mm", spacing_mm, kMinSpacing_mm, kMaxSpacing_mm);
  if (!ok) return tl::unexpected(ok.error());
  const Vec3 low = points.rowwise().minCoeff().array() - margin_mm;
  const Vec3 high = points.rowwise().maxCoeff().array() + margin_mm;
  FieldGrid grid;
  grid.spacing_mm = spacing_mm;
  for (int axis = 0; axis < 3; ++axis) {
    const double steps = std::ceil((high[axis] - low[axis]) / spacing_mm - kRounding);
    // One voxel more than steps, and the rim on both sides.
    const double count = std::max(steps, 0.0) + 3.0;
    if (count > FieldGrid::kMaxVoxelsAlongAxis) {
      return invalid(
          fmt::format("grid spacing {} mm: gives {:.0f} voxels along an axis, must be at most {}",
                      spacing_mm, count, FieldGrid::kMaxVoxelsAlongAxis));
    }
    grid.dims[static_cast<std::size_t>(axis)] = static_cast<int>(count);
    grid.origin_mm[axis] = 0.5 * (low[axis] + high[axis]) - 0.5 * (count - 1.0) * spacing_mm;
  }
  return validate(grid).map([&] { return grid; });
}

double OutsideTaper::factor(double distance_mm) const {
  if (distance_mm <= full_mm) return 1.0;
  if (distance_mm >= zero_mm) return 0.0;
  const double part = (distance_mm - full_mm) / (zero_mm - full_mm);
  return 0.5 * (1.0 + std::cos(std::numbers::pi * part));
}

Status validate(const OutsideTaper& taper) {
  constexpr double kFarthest_mm = 1000.0;
  const bool ok =
      taper.full_mm >= 0.0 && taper.full_mm < taper.zero_mm && taper.zero_mm <= kFarthest_mm;
  if (ok) return {};
  return invalid(fmt::format(
      "taper outside the brain: full up to {} mm, zero from {} mm: must be 0 <= full < zero <= {}",
      taper.full_mm, taper.zero_mm, kFarthest_mm));
}

}  // namespace brainshift::client
