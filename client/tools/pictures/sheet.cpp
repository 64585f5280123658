// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/sheet.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <sstream>

namespace brainshift::client {
namespace {

constexpr int kMargin = 40;
constexpr int kLegendRow = 70;
constexpr int kLegendText = 96;  // from an entry's stroke to its name
constexpr int kSubtitleRow = 40;
const TextStyle kTitleStyle{.cap_px = 28.0, .bold = true};
const TextStyle kSubtitleStyle{.cap_px = 19.0, .colour = palette::kGrey};
const TextStyle kLegendStyle{.cap_px = 20.0, .colour = palette::kWhite};

// Breaks at blanks into lines of at most `width` pixels; a longer word keeps a line of its own.
std::vector<std::string> wrapped(const std::string& text, const TextStyle& style, int width) {
  std::vector<std::string> lines;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (!lines.empty() && text_width(lines.back() + " " + word, style) <= width) {
      lines.back() += " " + word;
    } else {
      lines.push_back(word);
    }
  }
  return lines;
}

struct PlacedEntry {
  const LegendEntry* entry;
  cv::Point at;  // left end of the stroke; y from the top of the legend
};
// From left to right, in as many rows as `width` pixels need.
std::vector<PlacedEntry> place_legend(const std::vector<LegendEntry>& legend, int width) {
  std::vector<PlacedEntry> placed;
  cv::Point at(kMargin, kLegendRow / 2);
  for (const LegendEntry& entry : legend) {
    const int needed = kLegendText + text_width(entry.name, kLegendStyle);
    if (at.x > kMargin && at.x + needed > width - kMargin) at = {kMargin, at.y + kLegendRow};
    placed.push_back({&entry, at});
    at.x += needed + 60;
  }
  return placed;
}

// On a dark strip, because strokes are chosen for the MRI's dark ground.
void draw_legend(cv::Mat& image, int top, int height, const std::vector<PlacedEntry>& legend) {
  cv::rectangle(image, cv::Rect(0, top, image.cols, height), palette::kInk, cv::FILLED);
  for (const PlacedEntry& one : legend) {
    const int y = top + one.at.y;
    draw_polyline(image, {cv::Point2d(one.at.x, y), cv::Point2d(one.at.x + 80, y)},
                  one.entry->stroke);
    draw_text(image, {one.at.x + kLegendText, y + 10}, one.entry->name, kLegendStyle);
  }
}

}  // namespace

void name_in_legend(Sheet& sheet, const LegendEntry& entry) {
  const bool there =
      std::any_of(sheet.legend.begin(), sheet.legend.end(),
                  [&entry](const LegendEntry& other) { return other.name == entry.name; });
  if (!there) sheet.legend.push_back(entry);
}

cv::Mat compose(const Sheet& sheet) {
  constexpr int kPanelTitle = 56;
  constexpr int kBarWidth = 190;
  int height = 0;
  int width = kMargin;
  for (const Panel& panel : sheet.panels) {
    height = std::max(height, panel.image.rows);
    width += panel.image.cols + kMargin;
  }
  if (sheet.colour_max > 0.0) width += kBarWidth;
  // Narrow panels: the title decides, the rest is wrapped.
  width = std::max(width, text_width(sheet.title, kTitleStyle) + 2 * kMargin);
  const auto subtitle = wrapped(sheet.subtitle, kSubtitleStyle, width - 2 * kMargin);
  const auto legend = place_legend(sheet.legend, width);
  const int header = 130 + kSubtitleRow * std::max(0, static_cast<int>(subtitle.size()) - 1);
  const int legend_height = legend.empty() ? 0 : legend.back().at.y + kLegendRow / 2;
  cv::Mat image(header + kPanelTitle + height + legend_height + kMargin, width, CV_8UC3,
                palette::kWhite);
  draw_text(image, {kMargin, 58}, sheet.title, kTitleStyle);
  int baseline = 104;
  for (const std::string& line : subtitle) {
    draw_text(image, {kMargin, baseline}, line, kSubtitleStyle);
    baseline += kSubtitleRow;
  }
  int x = kMargin;
  for (const Panel& panel : sheet.panels) {
    draw_text(image, {x + panel.image.cols / 2, header + 36}, panel.title,
              {.cap_px = 22.0, .align = Align::kCentre, .bold = true});
    panel.image.copyTo(image(cv::Rect(cv::Point(x, header + kPanelTitle), panel.image.size())));
    x += panel.image.cols + kMargin;
  }
  if (sheet.colour_max > 0.0) {
    const cv::Rect bar(x, header + kPanelTitle + height / 8, 36, 3 * height / 4);
    draw_colour_bar(image, bar, {0.0, sheet.colour_max}, sheet.colour_label, palette::kInk);
  }
  if (!legend.empty())
    draw_legend(image, header + kPanelTitle + height + kMargin / 2, legend_height, legend);
  return image;
}

}  // namespace brainshift::client
