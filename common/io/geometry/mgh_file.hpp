// SPDX-License-Identifier: GPL-3.0-or-later
// FreeSurfer's volumes: .mgh, and .mgz, the same compressed by gzip.
//
// Big-endian. Header of 284 bytes: version 1, sizes along i, j, k, frames, type (0 uint8, 1 int32,
// 3 float32, 4 int16), dof as int32; a flag as int16; then float32: steps, direction cosines of i,
// j,
// k in scanner RAS, and c, the place of voxel (sizes / 2). Voxels follow, i fastest.
//   x = c + sum_a direction_a step_a (index_a - size_a / 2)
// Source: FreeSurfer's wiki, "FsTutorial/MghFormat".
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::io {

// kNotFound; kUnreadable naming file and field: another version or type, more than one frame,
// sizes not 1 to 32767, a flag of 0 (the place is unknown), steps or directions that are not
// finite or dependent, voxels that are truncated or damaged.
Result<VoxelImage> read_mgh(const std::filesystem::path& path);

}  // namespace brainshift::io
