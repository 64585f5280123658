// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/fields/displacement_field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace brainshift::io {
namespace {

constexpr double kMaxCosine = 1e-4;
constexpr std::size_t kLongestNote = 56;

Status check_values(const VoxelGrid& grid, const std::vector<float>& values,
                    std::size_t components) {
  if (values.size() != components * grid.num_voxels()) {
    return invalid(fmt::format("volume has {} values: must have {} for each of {} voxels",
                               values.size(), components, grid.num_voxels()));
  }
  const auto bad =
      std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
  if (bad == values.end()) return {};
  const std::size_t voxel = static_cast<std::size_t>(bad - values.begin()) / components;
  const auto nx = static_cast<std::size_t>(grid.dims[0]);
  const auto ny = static_cast<std::size_t>(grid.dims[1]);
  return fail(ErrorCode::kNotFinite, fmt::format("value of voxel ({}, {}, {}) is not finite",
                                                 voxel % nx, voxel / nx % ny, voxel / nx / ny));
}

Status check_note(const std::string& note) {
  const bool printable =
      std::all_of(note.begin(), note.end(), [](char c) { return c >= ' ' && c <= '~'; });
  if (printable && note.size() <= kLongestNote) return {};
  return invalid(fmt::format("note of {} characters: must be at most {} of printable ASCII",
                             note.size(), kLongestNote));
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
      if (cosine <= kMaxCosine) continue;
      return invalid(
          fmt::format("affine of the grid: voxel axes {} and {} are {:.3g} degrees off a right "
                      "angle: ITK's "
                      "files cannot hold a sheared grid",
                      a + 1, b + 1, std::asin(std::min(cosine, 1.0)) * 180.0 / 3.14159265358979));
    }
  }
  return {};
}

std::string_view to_string(FieldDirection direction) {
  return direction == FieldDirection::kResampling ? "resampling" : "modeling";
}

std::optional<FieldDirection> field_direction(std::string_view word) {
  for (const auto direction : {FieldDirection::kResampling, FieldDirection::kModeling}) {
    if (to_string(direction) == word) return direction;
  }
  return std::nullopt;
}

std::string_view to_string(VectorFrame frame) { return frame == VectorFrame::kRas ? "RAS" : "LPS"; }

Status validate(const DisplacementField& field) {
  return validate(field.grid).and_then([&] { return check_note(field.note); }).and_then([&] {
    return check_values(field.grid, field.ras_mm, 3);
  });
}

Status validate(const ScalarVolume& volume) {
  return validate(volume.grid).and_then([&] { return check_note(volume.note); }).and_then([&] {
    return check_values(volume.grid, volume.values, 1);
  });
}

}  // namespace brainshift::io
