// SPDX-License-Identifier: GPL-3.0-or-later
// Scatter and line charts with linear or logarithmic axes and labelled points. Private to client/report and the
// benchmarks: pulls in OpenCV.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "client/plot/canvas.hpp"

namespace brainshift::client {

struct XyPoint {
  double x = 0.0;
  double y = 0.0;
  std::string label;  // beside the marker; may be empty
};

struct XySeries {
  std::string legend;  // empty: not in the legend
  cv::Scalar colour = palette::kBlue;
  Marker marker = Marker::kCircle;
  bool line = false;  // joins the points in the order given
  double dash_px = 0.0;
  std::vector<XyPoint> points;
};

struct XyAxis {
  std::string label;  // with its unit
  bool log = false;
};

// Points that are not finite, or not positive on a logarithmic axis, are left out.
struct XyChartSpec {
  std::string title;
  std::string subtitle;
  XyAxis x;
  XyAxis y;
  std::vector<XySeries> series;
  cv::Size size{1800, 1000};
};

// 8-bit BGR. The rectangle of the data area is returned through `area` when asked for.
cv::Mat draw_xy_chart(const XyChartSpec& spec, cv::Rect* area = nullptr);

// Tick positions of a logarithmic axis within [min, max]: powers of ten; with 2 and 5 times these where there
// would be fewer than four; round numbers as on a linear axis where that is still fewer than three.
// Precondition: 0 < min < max.
std::vector<double> log_ticks(double min, double max);

// Shortest text of a tick: "0.002", "5", "20000"; "1e-05" and "1e+06" beyond.
std::string log_tick_label(double value);

// 0 at min, 1 at max. Precondition: min < max; on a logarithmic axis all positive.
double axis_fraction(double value, double min, double max, bool log);

}  // namespace brainshift::client
