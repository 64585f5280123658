// SPDX-License-Identifier: GPL-3.0-or-later
// FieldGrid: a regular grid of voxels for a displacement field, aligned with the axes of patient
// RAS, with the same spacing along all three.
//
// The centre of voxel (i, j, k) lies at origin_mm + spacing_mm * (i, j, k). Its value is number
// i + dims[0] * (j + dims[1] * k): x fastest, as VTK, NIfTI and OpenIGTLink have it.
//
// The outermost layer of voxels, the rim, is always zero: VTK repeats a grid transform's border
// value everywhere outside of the grid.
#pragma once

#include <array>
#include <cstddef>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"

namespace brainshift::client {

struct FieldGrid {
  // A head at 0.5 mm has 2^27 voxels; their vectors take 1.5 GiB.
  static constexpr std::size_t kMaxVoxels = std::size_t{1} << 27;
  // Of one axis: what an OpenIGTLink image can say.
  static constexpr int kMaxVoxelsAlongAxis = 65535;

  std::array<int, 3> dims{0, 0, 0};
  Vec3 origin_mm = Vec3::Zero();  // centre of voxel (0, 0, 0)
  double spacing_mm = 0.0;

  std::size_t num_voxels() const { return grid_size(dims); }
  std::size_t index(int i, int j, int k) const { return grid_index(dims, i, j, k); }
  Vec3 voxel_mm(int i, int j, int k) const { return origin_mm + spacing_mm * Vec3(i, j, k); }
  // Centre of the last voxel of every axis.
  Vec3 last_mm() const { return voxel_mm(dims[0] - 1, dims[1] - 1, dims[2] - 1); }
};

// kInvalidArgument: fewer than 3 voxels along an axis (a rim on both sides needs them) or more than
// kMaxVoxelsAlongAxis, more than kMaxVoxels in all, a spacing that is not above 0. kNotFinite: the
// origin or the spacing.
Status validate(const FieldGrid& grid);

// The smallest grid whose voxels inside the rim reach margin_mm beyond the bounding box of the
// points (3 x n), centred on that box.
// kEmptySet: no point. kNotFinite: a point. kInvalidArgument: margin_mm outside [0, 1000],
// spacing_mm outside [0.1, 100], or too many voxels (the sentence names the spacing).
Result<FieldGrid> grid_around(const Points& points, double margin_mm, double spacing_mm);

// OutsideTaper: how a brain's displacement ends outside of the brain.
//
// At distance d (mm) from the brain the field is u(closest point of the brain's surface) times
//
//   1                                                   d <= full_mm
//   (1 + cos(pi (d - full_mm) / (zero_mm - full_mm))) / 2   in between
//   0                                                   d >= zero_mm
//
// No model says what skull, cerebrospinal fluid and skin do: the taper is there so that an image
// is not torn at the brain's surface. Meshes are a voxel or two off the visible surface; the first
// 5 mm therefore move as the surface does. At 20 mm lies the skin. Its steepest slope is
// pi / 2 / 15 mm, so that shifts below 9.5 mm fold nothing.
struct OutsideTaper {
  double full_mm = 5.0;
  double zero_mm = 20.0;

  // Precondition: validate(taper). distance_mm >= 0; 0 inside the brain.
  double factor(double distance_mm) const;
};

// kInvalidArgument: must be 0 <= full_mm < zero_mm <= 1000.
Status validate(const OutsideTaper& taper);

}  // namespace brainshift::client
