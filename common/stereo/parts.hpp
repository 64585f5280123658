// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of a disparity map: valid pixels (not NaN) hang together when they are neighbours in a row or column and their
// disparities differ by at most a step.
#pragma once

#include "common/stereo/gray_image.hpp"

namespace brainshift::stereo {

struct PartSizes {
  int left = 0;     // pixels that are still valid
  int dropped = 0;  // pixels that were
  int largest = 0;  // of the largest part
};

// Makes NaN what belongs to a part of fewer than `least` pixels.
PartSizes drop_small_parts(PixelMap<float>& disparity, double max_step_px, int least);
// The same with the bound a fraction of the largest part.
PartSizes drop_minor_parts(PixelMap<float>& disparity, double max_step_px, double fraction);

}  // namespace brainshift::stereo
