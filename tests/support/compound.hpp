// SPDX-License-Identifier: GPL-3.0-or-later
// Freehand compounding: tracked images pasted into a volume, pixel by pixel.
//
//   V(x) = sum_p w_p(x) I_p / sum_p w_p(x)      over all pixels p of all frames used
//   kNearest: w = 1 for the voxel nearest to the pixel's place
//   kLinear:  w = the trilinear weights of the 8 voxels around it
//
// Voxels that no pixel reached have weight 0 and value 0. Holes are not filled.
// Sources: Trobaugh et al. 1994 (pixel nearest neighbour); Lasso et al., "PLUS: open-source
// toolkit for ultrasound-guided intervention systems", IEEE TBME 61 (2014): tests/sensing compares
// with its volumes.
#pragma once

#include <array>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/tracking/recording.hpp"
#include "common/ultrasound/frame_samples.hpp"

namespace brainshift::test_support {

using ultrasound::ImagePoses;
using ultrasound::PixelWindow;

// Voxel (i, j, k) has its centre at origin + spacing * (i, j, k) of the target frame.
struct VolumeGrid {
  std::array<int, 3> dims{0, 0, 0};
  Vec3 origin_mm = Vec3::Zero();
  Vec3 spacing_mm = Vec3::Ones();
};

// The smallest grid that begins at the corner of the frames' bounding box and has its size,
// rounded up to whole spacings.
// kEmptySet: no frame has a pose. kInvalidArgument: a window outside the image, a spacing that is
// not positive, more than 2^30 voxels.
Result<VolumeGrid> enclosing_grid(const tracking::Recording& recording, const ImagePoses& poses,
                                  const PixelWindow& window, const Vec3& spacing_mm);

enum class Paste { kNearest, kLinear };

struct CompoundedVolume {
  VoxelImage image;           // T_ras_voxel: to the poses' target frame, whichever that is
  std::vector<float> weight;  // per voxel, in pixels
};

// kInvalidArgument: poses and frames differ in number, a grid without voxels or with more than
// 2^30, a window outside the image.
Result<CompoundedVolume> compound(const tracking::Recording& recording, const ImagePoses& poses,
                                  const PixelWindow& window, const VolumeGrid& grid,
                                  Paste paste = Paste::kLinear);

}  // namespace brainshift::test_support
