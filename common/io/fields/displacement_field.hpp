// SPDX-License-Identifier: GPL-3.0-or-later
// DisplacementField: a vector for every voxel, with the direction in which it is meant.
//
//   modeling     x + v(x) is the deformed place of the undeformed point x: what points and models
//                need (3D Slicer: "to parent"). The grid is that of the undeformed brain.
//   resampling   x + v(x) is the undeformed place of the deformed point x: what resampling an image
//                needs, because it asks for every voxel of the result where it comes from (3D
//                Slicer: "from parent"; what ITK, ANTs and elastix mean by a transform). The grid
//                is that of the deformed brain.
//
// One is the inverse of the other, not its negative.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/io/fields/voxel_grid.hpp"

namespace brainshift::io {

enum class FieldDirection { kResampling, kModeling };
std::string_view to_string(FieldDirection direction);  // "resampling", "modeling"
// The words of to_string; none for any other.
std::optional<FieldDirection> field_direction(std::string_view word);

// The axes that a file's vectors are along. Their places are RAS or LPS as the format has it.
enum class VectorFrame { kRas, kLps };
std::string_view to_string(VectorFrame frame);  // "RAS", "LPS"

struct DisplacementField {
  VoxelGrid grid;
  FieldDirection direction = FieldDirection::kResampling;
  // RAS, mm; the three numbers of a voxel in one piece: 3 * grid.num_voxels().
  std::vector<float> ras_mm;
  // For people, ASCII, at most 56 characters; written where the format has a place: update,
  // quality.
  std::string note;
};

// validate(grid); kInvalidArgument: another number of values, or a note that does not fit.
// kNotFinite: a value (the sentence names its voxel).
Status validate(const DisplacementField& field);

// A volume of numbers, e.g. a standard deviation in mm, with a note as above.
struct ScalarVolume {
  VoxelGrid grid;
  std::vector<float> values;
  std::string note;
};
Status validate(const ScalarVolume& volume);

}  // namespace brainshift::io
