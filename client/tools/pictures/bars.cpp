// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/bars.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "client/tools/pictures/axes.hpp"
#include "client/tools/pictures/ticks.hpp"

namespace brainshift::client {
namespace {

constexpr double kWidestBar = 180.0;
constexpr double kGap = 8.0;  // between bars
const Stroke kReferenceTick{palette::kBlack, 4, 0.0};

// From left to right, px.
struct Slot {
  double x = 0.0;
  double width = 0.0;
};

void draw_bar(cv::Mat& image, const Frame& frame, const Slot& slot, double value,
              const BarSeries& series, const BarSpec& spec) {
  const double base = frame(0.0, std::clamp(0.0, spec.y_min, spec.y_max)).y;
  const double tip = frame(0.0, std::clamp(value, spec.y_min, spec.y_max)).y;
  const cv::Point corner(static_cast<int>(slot.x),
                         static_cast<int>(std::lround(std::min(base, tip))));
  const cv::Size size(static_cast<int>(slot.width),
                      std::max(1, static_cast<int>(std::lround(std::abs(base - tip)))));
  cv::rectangle(image, cv::Rect(corner, size), series.colour, cv::FILLED);
  if (!spec.figures) return;
  // The figure stands at the bar's foot, where no reference mark can hide it.
  const std::string text = fixed_decimals(value, spec.decimals);
  const TextStyle style{.align = Align::kCentre};
  const cv::Point at(static_cast<int>(slot.x + slot.width / 2), static_cast<int>(base) - 20);
  const int half = text_width(text, style) / 2 + 10;
  cv::rectangle(image, cv::Rect(at.x - half, at.y - 30, 2 * half, 40), palette::kWhite, cv::FILLED);
  draw_text(image, at, text, style);
}

void draw_reference(cv::Mat& image, const Frame& frame, const Slot& slot, double value,
                    const BarSpec& spec) {
  const double y = frame(0.0, std::clamp(value, spec.y_min, spec.y_max)).y;
  const std::vector<cv::Point2d> across = {{slot.x, y}, {slot.x + slot.width, y}};
  draw_polyline(image, across, {palette::kWhite, 9, 0.0});
  draw_polyline(image, across, kReferenceTick);
}

// One line per part of the name: side by side, whole names would run into each other.
void draw_group_name(cv::Mat& image, const cv::Rect& area, double middle, const std::string& name) {
  int baseline = area.y + area.height + 36;
  std::istringstream lines(name);
  for (std::string line; std::getline(lines, line); baseline += 28) {
    draw_text(image, {static_cast<int>(middle), baseline}, line,
              {.cap_px = 17.0, .align = Align::kCentre});
  }
}

std::vector<LegendSample> bar_legend(const BarSpec& spec) {
  std::vector<LegendSample> samples;
  for (const BarSeries& series : spec.series)
    samples.push_back({series.legend, {series.colour, 1, 0.0}, Marker::kNone, true});
  if (!spec.references.empty())
    samples.push_back({spec.reference_legend, kReferenceTick, Marker::kNone, false});
  return samples;
}

}  // namespace

cv::Mat draw_bars(const BarSpec& spec, cv::Rect* area) {
  cv::Mat image(spec.size, CV_8UC3, palette::kWhite);
  const auto groups = static_cast<double>(std::max<std::size_t>(1, spec.groups.size()));
  const auto bars = static_cast<double>(std::max<std::size_t>(1, spec.series.size()));
  draw_titles(image, spec.title, spec.subtitle);
  Frame frame;
  frame.area = draw_legend(image, bar_legend(spec));
  frame.x = {{}, {0.0, groups}};
  frame.y = {{spec.y_label}, {spec.y_min, spec.y_max}};
  draw_y_axis(image, frame);
  draw_border(image, frame);
  if (spec.y_min < 0.0) {
    draw_polyline(image, {frame(0.0, 0.0), frame(groups, 0.0)}, {palette::kInk, 2, 0.0});
  }
  const double pitch = std::min(kWidestBar, 0.8 * frame.area.width / groups / bars);
  for (std::size_t g = 0; g < spec.groups.size(); ++g) {
    const double middle = frame(static_cast<double>(g) + 0.5, spec.y_min).x;
    draw_group_name(image, frame.area, middle, spec.groups[g]);
    for (std::size_t s = 0; s < spec.series.size(); ++s) {
      const double left = middle + (static_cast<double>(s) - 0.5 * bars) * pitch;
      const Slot slot{left + 0.5 * kGap, pitch - kGap};
      if (const auto& value = spec.series[s].values.at(g))
        draw_bar(image, frame, slot, *value, spec.series[s], spec);
      if (s >= spec.references.size()) continue;
      if (const auto& reference = spec.references[s].at(g))
        draw_reference(image, frame, slot, *reference, spec);
    }
  }
  if (area != nullptr) *area = frame.area;
  return image;
}

}  // namespace brainshift::client
