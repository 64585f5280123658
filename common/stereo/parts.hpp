// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of a disparity map. Two valid pixels (not NaN) are connected when they are neighbours in a
// row or column and their disparities differ by at most a step.
#pragma once

#include "common/stereo/gray_image.hpp"

namespace brainshift::stereo {

struct PartSizes {
  int left = 0;     // pixels that are still valid
  int dropped = 0;  // pixels that are no longer valid
  int largest = 0;  // pixels of the largest part
};

// Sets the pixels of every part with fewer than `least` pixels to NaN.
PartSizes drop_small_parts(PixelMap<float>& disparity, double max_step_px, int least);
// The same with a fraction of the largest part as the bound.
PartSizes drop_minor_parts(PixelMap<float>& disparity, double max_step_px, double fraction);

}  // namespace brainshift::stereo
