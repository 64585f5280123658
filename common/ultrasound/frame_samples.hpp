// SPDX-License-Identifier: GPL-3.0-or-later
// Tracked frames as places with intensities, for registration to another image.
//
// Pixels are averaged in square blocks, which evens out speckle. A block becomes one sample at the
// mean of its pixels' places. Only blocks that lie wholly in the scanned sector are taken: pixels
// outside of the sector are 0 in every frame of a recording, pixels inside hardly ever.
#pragma once

#include "common/core/error.hpp"
#include "common/ultrasound/compound.hpp"
#include "common/values/intensity_samples.hpp"

namespace brainshift::ultrasound {

// Places in the poses' target frame, mm; intensities in the recording's grey levels. Frames
// without a pose or without a valid image are left out.
// kInvalidArgument: poses and frames differ in number, block_px outside 1 to 100. kEmptySet: no
// frame to use, no block in the sector.
Result<IntensitySamples> frame_samples(const tracking::Recording& recording,
                                       const ImagePoses& poses, const PixelWindow& window,
                                       int block_px);

}  // namespace brainshift::ultrasound
