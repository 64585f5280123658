// SPDX-License-Identifier: GPL-3.0-or-later
// What is dropped of a measured surface: points that stand apart, and small parts of a disparity
// map.
#pragma once

#include <vector>

#include "common/core/types.hpp"
#include "common/stereo/gray_image.hpp"

namespace brainshift::stereo {

// Points that stand apart from the others (Rusu, Marton, Blodow, Dolha & Beetz 2008). The mean
// distance of a point to its nearest neighbours is compared with the mean of that figure over all
// points.
//
// points: 3 x n, any unit of length. True where the mean distance to the `neighbours` nearest
// points exceeds its mean by `sds` standard deviations and is more than twice the mean, so that
// the rim of a regular grid is not an outlier. With n <= neighbours, no point is an outlier.
std::vector<bool> distance_outliers(const Points& points, double sds, int neighbours = 8);

// Parts of a disparity map. Two valid pixels (not NaN) are connected when they are neighbours in a
// row or column and their disparities differ by at most a step.
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
