// SPDX-License-Identifier: GPL-3.0-or-later
// Volumes for other programs: where the voxels lie, and a vector or a number for each of them.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

// VoxelGrid: where the voxels of a volume lie, as image files say it.
//
//   x_ras = T_ras_voxel * (i, j, k)      centre of voxel (i, j, k), mm
//   value number i + dims[0] * (j + dims[1] * k)
//
// The grid may be oblique, anisotropic and flipped (left-handed). Its axes are at right angles:
// ITK's files and qforms can say nothing else.
struct VoxelGrid {
  // 400 voxels along each axis. The vectors of so many take 0.75 GiB.
  static constexpr std::size_t kMaxVoxels = std::size_t{1} << 26;
  // NIfTI-1 keeps them as 16-bit numbers.
  static constexpr int kMaxVoxelsAlongAxis = 32767;

  std::array<int, 3> dims{0, 0, 0};
  AffineTransform T_ras_voxel = AffineTransform::Identity();

  std::size_t num_voxels() const { return grid_size(dims); }
  std::size_t index(int i, int j, int k) const { return grid_index(dims, i, j, k); }
  Vec3 voxel_mm(int i, int j, int k) const { return T_ras_voxel * Vec3(i, j, k); }
  Vec3 spacing_mm() const { return T_ras_voxel.linear().colwise().norm().transpose(); }
  // Unit vectors along the voxel axes, RAS; one per column. The determinant is -1 when flipped.
  Mat3 directions() const {
    return T_ras_voxel.linear() * spacing_mm().cwiseInverse().asDiagonal();
  }
};

// Ok, or one sentence: kNotFinite (an entry of the affine), kInvalidArgument (no voxel along an
// axis, too many along one or in all; a spacing that is 0; axes whose cosine exceeds 1e-4, i.e. a
// sheared grid. Single-precision headers are good to 1e-6).
Status validate(const VoxelGrid& grid);

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
