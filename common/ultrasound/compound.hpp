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
#include <optional>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/tracking/recording.hpp"
#include "common/values/intensity_samples.hpp"

namespace brainshift::ultrasound {

// Voxel (i, j, k) has its centre at origin + spacing * (i, j, k) of the target frame.
struct VolumeGrid {
  std::array<int, 3> dims{0, 0, 0};
  Vec3 origin_mm = Vec3::Zero();
  Vec3 spacing_mm = Vec3::Ones();
};

// Pixels u in [left, left + width), v alike. The part outside of the image is ignored.
struct PixelWindow {
  int left = 0, top = 0, width = 0, height = 0;
};

// T_target_image (pixels to mm) of every frame of the recording, nothing where it is not used.
using ImagePoses = std::vector<std::optional<AffineTransform>>;

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

// Tracked frames as places with intensities, for registration to another image.
//
// Pixels are averaged in square blocks, which evens out speckle. A block becomes one sample at the
// mean of its pixels' places. Only blocks that lie wholly in the scanned sector are taken: pixels
// outside of the sector are 0 in every frame of a recording, pixels inside hardly ever.

// Places in the poses' target frame, mm; intensities in the recording's grey levels. Frames
// without a pose or without a valid image are left out.
// kInvalidArgument: poses and frames differ in number, block_px outside 1 to 100. kEmptySet: no
// frame to use, no block in the sector.
Result<IntensitySamples> frame_samples(const tracking::Recording& recording,
                                       const ImagePoses& poses, const PixelWindow& window,
                                       int block_px);

}  // namespace brainshift::ultrasound
