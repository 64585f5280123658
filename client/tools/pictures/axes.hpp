// SPDX-License-Identifier: GPL-3.0-or-later
// What stands round the data of every chart: titles, legend, axes with ticks and grid.
//
// Lengths are device pixels (canvas.hpp). The legend stands between the titles and the data area
// and takes as many rows as it needs.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "client/tools/pictures/canvas.hpp"

namespace brainshift::client {

struct Axis {
  std::string label;      // with its unit
  bool log = false;       // logarithmic: shows positive values only
  bool counts = false;    // ticks at whole numbers only
  bool from_zero = true;  // a linear axis whose values are all >= 0 starts at 0
};

// Finite; positive on a logarithmic axis.
bool can_show(double value, const Axis& axis);

struct Range {
  double min = 1.0;
  double max = 0.0;
  bool empty() const { return max < min; }
  void include(double value);
};

// The range with room for markers at its ends; an empty one becomes [0, 1], or [0.1, 10] on a
// logarithmic axis.
Range padded(const Range& data, const Axis& axis);

struct Scale {
  Axis axis;
  Range range;  // not empty
};

// Maps values to pixels of the data area.
struct Frame {
  cv::Rect area;
  Scale x, y;
  cv::Point2d operator()(double vx, double vy) const;
};

struct LegendSample {
  std::string name;
  Stroke stroke;  // thickness 0: no line
  Marker marker = Marker::kNone;
  bool bar = false;  // a filled bar of the stroke's colour instead of a line
};

void draw_titles(cv::Mat& image, const std::string& title, const std::string& subtitle);

// Below the titles, in rows. Returns the data area that remains; `right_axis` keeps room for one.
cv::Rect draw_legend(cv::Mat& image, const std::vector<LegendSample>& samples,
                     bool right_axis = false);

// Labels, ticks and grid lines. The right axis has ticks only, in its own colour, and no grid.
void draw_x_axis(cv::Mat& image, const Frame& frame);
void draw_y_axis(cv::Mat& image, const Frame& frame);
void draw_right_axis(cv::Mat& image, const Frame& frame, const cv::Scalar& colour);

}  // namespace brainshift::client
