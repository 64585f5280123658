// SPDX-License-Identifier: GPL-3.0-or-later
// Charts of lines and labelled points over linear or logarithmic axes, with an optional right axis;
// and bars.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/pictures/axes.hpp"
#include "client/tools/pictures/canvas.hpp"

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

// Bars side by side in groups, each with an optional published value to compare it with.
struct BarSeries {
  std::string legend;
  cv::Scalar colour;
  std::vector<std::optional<double>> values;  // one per group; nullopt: no bar
};

struct BarSpec {
  std::string title;
  std::string subtitle;
  std::string y_label;
  std::vector<std::string> groups;  // names, up to three lines each
  std::vector<BarSeries> series;
  // Published values, one list per series; drawn as a black tick across the bar.
  std::string reference_legend;
  std::vector<std::vector<std::optional<double>>> references;
  // A bar that ends outside [y_min, y_max] is cut there; its figure still shows the value.
  double y_min = 0.0;
  double y_max = 100.0;
  int decimals = 1;
  bool figures = true;  // the value at every bar's foot; many narrow bars have no room for them
  cv::Size size{1800, 1000};
};

// 8-bit BGR. `area` receives the rectangle of the data area when it is given.
// Precondition: y_min < y_max; every list of values and references has one entry per group.
cv::Mat draw_bars(const BarSpec& spec, cv::Rect* area = nullptr);

}  // namespace brainshift::client
