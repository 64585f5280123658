// SPDX-License-Identifier: GPL-3.0-or-later
// Panels side by side under one title, with a legend and a colour bar.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "client/tools/pictures/canvas.hpp"

namespace brainshift::client {

struct Panel {
  std::string title;
  cv::Mat image;
};
struct LegendEntry {
  std::string name;
  Stroke stroke;
};
struct Sheet {
  std::string title;
  std::string subtitle;
  std::vector<Panel> panels;
  std::vector<LegendEntry> legend;
  double colour_max = 0.0;  // 0: no colour bar
  std::string colour_label;
};

// Into the legend, once: for what is drawn in one of several panels.
void name_in_legend(Sheet& sheet, const LegendEntry& entry);

// 8-bit BGR, as large as its parts need. Narrow panels: subtitle and legend are wrapped.
cv::Mat compose(const Sheet& sheet);

}  // namespace brainshift::client
