// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/fields/displacement_field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace brainshift::io {
namespace {

constexpr std::size_t kLongestNote = 56;

Status check_values(const VoxelGrid& grid, const std::vector<float>& values,
                    std::size_t components) {
  if (values.size() != components * grid.num_voxels()) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("volume has {} values: must have {} for each of {} voxels",
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
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("note of {} characters: must be at most {} of printable ASCII",
                          note.size(), kLongestNote));
}

}  // namespace

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
