// SPDX-License-Identifier: GPL-3.0-or-later
// What of a brain mask hangs on the rest by a thin neck, as orbits, scalp and skull do into which a
// mask has leaked.
#pragma once

#include "common/core/mesh.hpp"
#include "common/core/types.hpp"

namespace brainshift::anatomy {

struct MaskLeak {
  double volume_mm3 = 0.0;     // 0: nothing hangs
  Vec3 centre = Vec3::Zero();  // mm RAS
};

// The largest 6-connected part of the voxels > 0 that lies farther than 8 mm from the largest part
// of the mask eroded by 6 mm, after gaps below 6 mm are closed; on voxels of about 2 mm.
// Colin27, MNI152 and 14 heads of label maps have at most 0.7 cc, made-up leaks of 30 cc into
// orbits and of 110 cc into the skull 13 to 120 cc. What is joined more widely does not show: a
// neck of 40 mm below the brainstem, or a layer of 6 mm that lies on the brain.
MaskLeak mask_leak(const VoxelImage& mask);

// What is worth a look, mm3.
inline constexpr double kLeak_mm3 = 5000.0;

}  // namespace brainshift::anatomy
