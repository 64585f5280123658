// SPDX-License-Identifier: GPL-3.0-or-later
// Tracked frames as places with intensities, for registration to another image.
//
// Pixels are averaged in square blocks, which evens out speckle; a block becomes one sample at the mean of its
// pixels' places. Only blocks all of whose pixels belong to the image are taken: pixels outside of the scanned
// sector are 0 in every frame of a recording, those inside hardly ever.
#pragma once

#include "common/core/error.hpp"
#include "common/core/intensity_samples.hpp"
#include "common/ultrasound/compound.hpp"

namespace brainshift::ultrasound {

// In the poses' target frame. Frames without a pose or without a valid image are left out.
// kInvalidArgument: poses and frames differ in number, block_px outside 1 to 100; kEmptySet: no frame to use, no
// block in the sector.
Result<IntensitySamples> frame_samples(const tracking::Recording& recording,
                                       const ImagePoses& poses, const PixelWindow& window,
                                       int block_px);

}  // namespace brainshift::ultrasound
