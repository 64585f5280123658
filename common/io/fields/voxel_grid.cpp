// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/fields/voxel_grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace brainshift::io {
namespace {

constexpr double kMostCosine = 1e-4;

tl::unexpected<Error> invalid(std::string message) {
  return fail(ErrorCode::kInvalidArgument, std::move(message));
}

}  // namespace

Status validate(const VoxelGrid& grid) {
  const auto [nx, ny, nz] = grid.dims;
  const std::string size = fmt::format("grid of {} x {} x {} voxels", nx, ny, nz);
  if (std::min({nx, ny, nz}) < 1) return invalid(size + ": must have at least 1 along every axis");
  if (std::max({nx, ny, nz}) > VoxelGrid::kMaxVoxelsAlongAxis) {
    return invalid(fmt::format("{}: must have at most {} along an axis", size,
                               VoxelGrid::kMaxVoxelsAlongAxis));
  }
  if (grid.num_voxels() > VoxelGrid::kMaxVoxels) {
    return invalid(
        fmt::format("{}: must have at most {} voxels in all", size, VoxelGrid::kMaxVoxels));
  }
  if (!grid.T_ras_voxel.affine().allFinite()) {
    return fail(ErrorCode::kNotFinite, "affine of the grid: an entry is not finite");
  }
  if (!(grid.spacing_mm().minCoeff() > 0.0)) {
    return invalid("affine of the grid: a voxel axis has no length");
  }
  const Mat3 directions = grid.directions();
  for (int a = 0; a < 3; ++a) {
    for (int b = a + 1; b < 3; ++b) {
      const double cosine = std::abs(directions.col(a).dot(directions.col(b)));
      if (cosine <= kMostCosine) continue;
      return invalid(fmt::format(
          "affine of the grid: voxel axes {} and {} are {:.3g} degrees off a right angle: ITK's "
          "files cannot hold a sheared grid",
          a + 1, b + 1, std::asin(std::min(cosine, 1.0)) * 180.0 / 3.14159265358979));
    }
  }
  return {};
}

}  // namespace brainshift::io
