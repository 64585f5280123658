// SPDX-License-Identifier: GPL-3.0-or-later
// The map of one sheet: a panel per parameter, a row per method, a marker per point.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "tests/stability/stability_point.hpp"

namespace brainshift::stability {

// 8-bit BGR. Points of other sheets are left out.
cv::Mat draw_map(const std::string& sheet, const std::string& title,
                 const std::vector<Point>& points);

}  // namespace brainshift::stability
