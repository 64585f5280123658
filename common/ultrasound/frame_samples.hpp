// SPDX-License-Identifier: GPL-3.0-or-later
// Tracked frames as places with intensities, for registration to another image.
//
// Pixels are averaged in square blocks, which evens out speckle. A block becomes one sample at the
// mean of its pixels' places. Only blocks that lie wholly in the scanned sector are taken: pixels
// outside of the sector are 0 in every frame of a recording, pixels inside hardly ever.
#pragma once

#include <optional>
#include <vector>

#include "common/core/error.hpp"
#include "common/tracking/recording.hpp"
#include "common/values/intensity_samples.hpp"

namespace brainshift::ultrasound {

// Pixels u in [left, left + width), v alike. The part outside of the image is ignored.
struct PixelWindow {
  int left = 0, top = 0, width = 0, height = 0;
};

// T_target_image (pixels to mm) of every frame of the recording, nothing where it is not used.
using ImagePoses = std::vector<std::optional<AffineTransform>>;

// Places in the poses' target frame, mm; intensities in the recording's grey levels. Frames
// without a pose or without a valid image are left out.
// kInvalidArgument: poses and frames differ in number, block_px outside 1 to 100. kEmptySet: no
// frame to use, no block in the sector.
Result<IntensitySamples> frame_samples(const tracking::Recording& recording,
                                       const ImagePoses& poses, const PixelWindow& window,
                                       int block_px);

}  // namespace brainshift::ultrasound
