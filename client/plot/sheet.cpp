// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/plot/sheet.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace brainshift::client {
namespace {

// On a dark strip, because strokes are chosen for the MRI's dark ground.
void draw_legend(cv::Mat& image, int y, const std::vector<LegendEntry>& legend) {
  cv::rectangle(image, cv::Rect(0, y, image.cols, 70), palette::kInk, cv::FILLED);
  int x = 40;
  for (const LegendEntry& entry : legend) {
    draw_polyline(image, {cv::Point2d(x, y + 35), cv::Point2d(x + 80, y + 35)}, entry.stroke);
    const TextStyle style{.cap_px = 20.0,
                          .colour = palette::kWhite,
                          .align = Align::kLeft,
                          .bold = false,
                          .halo = false};
    draw_text(image, {x + 96, y + 45}, entry.name, style);
    x += 96 + text_width(entry.name, style) + 60;
  }
}

}  // namespace

cv::Mat compose(const Sheet& sheet) {
  constexpr int kMargin = 40;
  constexpr int kHeader = 130;
  constexpr int kPanelTitle = 56;
  constexpr int kBarWidth = 190;
  int height = 0;
  int width = kMargin;
  for (const Panel& panel : sheet.panels) {
    height = std::max(height, panel.image.rows);
    width += panel.image.cols + kMargin;
  }
  if (sheet.colour_max > 0.0) width += kBarWidth;
  const int legend = sheet.legend.empty() ? kMargin : 70 + kMargin;
  cv::Mat image(kHeader + kPanelTitle + height + legend, width, CV_8UC3, palette::kWhite);
  draw_text(image, {kMargin, 58}, sheet.title, {.cap_px = 28.0, .bold = true});
  draw_text(image, {kMargin, 104}, sheet.subtitle, {.cap_px = 19.0, .colour = palette::kGrey});
  int x = kMargin;
  for (const Panel& panel : sheet.panels) {
    draw_text(image, {x + panel.image.cols / 2, kHeader + 36}, panel.title,
              {.cap_px = 22.0, .align = Align::kCentre, .bold = true});
    panel.image.copyTo(image(cv::Rect(cv::Point(x, kHeader + kPanelTitle), panel.image.size())));
    x += panel.image.cols + kMargin;
  }
  if (sheet.colour_max > 0.0) {
    const cv::Rect bar(x, kHeader + kPanelTitle + height / 8, 36, 3 * height / 4);
    draw_colour_bar(image, bar, {0.0, sheet.colour_max}, sheet.colour_label, palette::kInk);
  }
  if (!sheet.legend.empty())
    draw_legend(image, kHeader + kPanelTitle + height + kMargin / 2, sheet.legend);
  return image;
}

}  // namespace brainshift::client
