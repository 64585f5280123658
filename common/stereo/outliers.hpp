// SPDX-License-Identifier: GPL-3.0-or-later
// Points that stand apart from the others (Rusu, Marton, Blodow, Dolha & Beetz 2008). The mean
// distance of a point to its nearest neighbours is compared with the mean of that figure over all
// points.
#pragma once

#include <vector>

#include "common/core/types.hpp"

namespace brainshift::stereo {

// points: 3 x n, any unit of length. True where the mean distance to the `neighbours` nearest
// points exceeds its mean by `sds` standard deviations and is more than twice the mean, so that
// the rim of a regular grid is not an outlier. With n <= neighbours, no point is an outlier.
std::vector<bool> distance_outliers(const Points& points, double sds, int neighbours = 8);

}  // namespace brainshift::stereo
