// SPDX-License-Identifier: GPL-3.0-or-later
// VoxelGrid: where the voxels of a volume lie, as image files say it.
//
//   x_ras = T_ras_voxel * (i, j, k)      centre of voxel (i, j, k), mm
//   value number i + dims[0] * (j + dims[1] * k)
//
// The grid may be oblique, anisotropic and flipped (left-handed). Its axes are at right angles:
// ITK's files and qforms can say nothing else.
#pragma once

#include <array>
#include <cstddef>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

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

}  // namespace brainshift::io
