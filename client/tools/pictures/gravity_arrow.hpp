// SPDX-License-Identifier: GPL-3.0-or-later
// The arrow named "gravity" in the upper left corner of a picture of a head.
#pragma once

#include <opencv2/core.hpp>

namespace brainshift::client {

// `along`: the direction of gravity, a unit vector, seen in the picture; pixels run right and down.
// Where gravity is nearly along the line of sight, the words "along view" stand instead.
void draw_gravity_arrow(cv::Mat& image, cv::Point2d along);

}  // namespace brainshift::client
