// SPDX-License-Identifier: GPL-3.0-or-later
// Charts of lines and labelled points over linear or logarithmic axes, with an optional right
// axis.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "client/tools/pictures/axes.hpp"

namespace brainshift::client {

struct ChartPoint {
  double x = 0.0;
  double y = 0.0;
  std::string label;  // beside the marker; may be empty
};

struct Series {
  std::string legend;  // empty: not in the legend
  cv::Scalar colour = palette::kBlue;
  Marker marker = Marker::kCircle;
  bool line = false;  // joins the points in the order given
  double dash_px = 0.0;
  std::vector<ChartPoint> points;
  bool right_axis = false;
};

// A point that an axis cannot show (can_show) is left out and interrupts its line.
struct ChartSpec {
  std::string title;
  std::string subtitle;
  Axis x;
  Axis y;
  std::vector<Series> series;
  Axis right;  // drawn where a series uses it, in the colour of the first that does
  cv::Size size{1800, 1000};
};

// 8-bit BGR. `area` receives the rectangle of the data area when it is given. The axes span all
// points that they can show, so that at most a marker's radius is drawn outside the data area. A
// label for which no free place is found is left out.
cv::Mat draw_chart(const ChartSpec& spec, cv::Rect* area = nullptr);

}  // namespace brainshift::client
