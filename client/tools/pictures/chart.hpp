// SPDX-License-Identifier: GPL-3.0-or-later
// Charts as SVG: lines and labelled points over linear or logarithmic axes, with an optional right
// axis; and bars. They have no script: the cursor over a column shows the values there (<title>).
//
// Colours of text and ground are the page's variables --ink, --soft, --rule and --ground where it
// has them, so that a chart on a page follows its theme, and fits a white ground by itself.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
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

struct ChartPoint {
  double x = 0.0;
  double y = 0.0;
  std::string label = {};  // beside the marker; may be empty
  double sd = 0.0;         // half the height of a band about the line
  std::string note = {};   // what the cursor shows beside the values
};

struct Series {
  std::string legend;  // also names its values; empty: not in the legend
  cv::Scalar colour = palette::kBlue;
  Marker marker = Marker::kCircle;
  bool line = false;  // joins the points in the order given
  double dash_px = 0.0;
  std::vector<ChartPoint> points = {};
  bool right_axis = false;
};

// A point that an axis cannot show (not finite; not positive where logarithmic) is left out and
// interrupts its line.
struct ChartSpec {
  std::string title;
  std::string subtitle;
  Axis x;
  Axis y;
  std::vector<Series> series;
  Axis right;  // drawn where a series uses it, in the colour of the first that does
  cv::Size size{900, 420};
};
std::string draw_chart(const ChartSpec& spec);

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
  // Published values, one list per series; drawn as a tick across the bar.
  std::string reference_legend;
  std::vector<std::vector<std::optional<double>>> references;
  // A bar that ends outside [y_min, y_max] is cut there; its figure still shows the value.
  double y_min = 0.0;
  double y_max = 100.0;
  cv::Size size{900, 420};
};
// Precondition: y_min < y_max; every list of values and references has one entry per group.
std::string draw_bars(const BarSpec& spec);

// Text inside HTML or SVG: with &, <, >, " and ' replaced by their entities.
std::string escape_html(std::string_view text);

}  // namespace brainshift::client
