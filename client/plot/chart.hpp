// SPDX-License-Identifier: GPL-3.0-or-later
// Line and bar charts with axes, ticks, legend and title. Private to client/report: pulls in OpenCV.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/plot/canvas.hpp"

namespace brainshift::client {

struct Series {
  std::string legend;
  std::vector<double> x;
  std::vector<double> y;  // same length; a value that is not finite interrupts the line
  bool right_axis = false;
  cv::Scalar colour = palette::kBlue;
  Marker marker = Marker::kCircle;
  double dash_px = 0.0;
};

struct ReferenceLine {
  std::string legend;
  double y = 0.0;  // on the left axis
  cv::Scalar colour = palette::kGrey;
};

// Both vertical axes start at 0. The right axis is drawn when a series uses it.
struct ChartSpec {
  std::string title;
  std::string subtitle;
  std::string x_label;
  std::string left_label;
  std::string right_label;
  std::vector<Series> series;
  std::vector<ReferenceLine> references;
  cv::Size size{1800, 1080};
};

// 8-bit BGR. The rectangle of the data area is returned through `area` when asked for; no data are drawn
// outside it but for a rim of 10 pixels that keeps markers of extreme values whole.
cv::Mat draw_chart(const ChartSpec& spec, cv::Rect* area = nullptr);

struct BarSeries {
  std::string legend;
  cv::Scalar colour;
  std::vector<std::optional<double>> values;  // one per group
};

struct BarSpec {
  std::string title;
  std::string subtitle;
  std::string y_label;
  std::vector<std::string> groups;  // names, up to three lines each
  std::vector<BarSeries> series;
  // Published values to compare with, one list per series; drawn as a black tick across the bar.
  std::string reference_legend;
  std::vector<std::vector<std::optional<double>>> references;
  double y_min = 0.0;  // bars below are cut and still labelled with their value
  double y_max = 100.0;
  int decimals = 1;
  bool figures = true;  // the value at every bar's foot; many narrow bars have no room for them
  cv::Size size{1800, 1000};
};

cv::Mat draw_bars(const BarSpec& spec, cv::Rect* area = nullptr);

}  // namespace brainshift::client
