// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/chart.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <sstream>

namespace brainshift::client {
namespace {

constexpr int kLineWidth = 4;
constexpr double kLabelCap = 17.0;

// A point of a series, where it is drawn. Points that cannot be shown have no place.
struct Placed {
  const ChartPoint* point = nullptr;
  cv::Point2d at;
};

// The series' points in runs that no missing point interrupts.
std::vector<std::vector<Placed>> runs_of(const Series& series, const Frame& frame) {
  std::vector<std::vector<Placed>> runs(1);
  for (const ChartPoint& p : series.points) {
    if (can_show(p.x, frame.x.axis) && can_show(p.y, frame.y.axis)) {
      runs.back().push_back({&p, frame(p.x, p.y)});
    } else if (!runs.back().empty()) {
      runs.emplace_back();
    }
  }
  return runs;
}

void draw_series(cv::Mat& image, const Series& series,
                 const std::vector<std::vector<Placed>>& runs) {
  for (const auto& run : runs) {
    std::vector<cv::Point2d> line;
    for (const Placed& p : run) line.push_back(p.at);
    if (series.line) draw_polyline(image, line, {series.colour, kLineWidth, series.dash_px});
    for (const cv::Point2d& at : line)
      draw_marker(image, at, series.marker, series.colour, kMarkerRadius);
  }
}

// Writes labels beside their markers, each where it covers no other label and no marker.
class Labels {
 public:
  Labels(cv::Mat& image, const cv::Rect& area) : image_(image), area_(area) {}

  void keep_free(cv::Point2d marker) {
    const cv::Point centre(static_cast<int>(marker.x), static_cast<int>(marker.y));
    constexpr int kHalf = kMarkerRadius + 1;
    taken_.emplace_back(centre - cv::Point(kHalf, kHalf), cv::Size(2 * kHalf, 2 * kHalf));
  }

  // At the first place of a list that is free and inside the data area; else nowhere.
  void write(const std::string& text, cv::Point2d marker, const cv::Scalar& colour) {
    const TextStyle style{.cap_px = kLabelCap, .colour = colour};
    const int width = text_width(text, style);
    const int height = static_cast<int>(kLabelCap) + 6;
    const cv::Point p(static_cast<int>(marker.x), static_cast<int>(marker.y));
    for (const int step : {0, 1, 2, 3}) {
      const int up = step * height;
      const cv::Point lower_left[] = {
          {p.x + 16, p.y + 8 - up},         {p.x - 16 - width, p.y + 8 - up},
          {p.x + 16, p.y + 8 + up},         {p.x - 16 - width, p.y + 8 + up},
          {p.x - width / 2, p.y - 18 - up}, {p.x - width / 2, p.y + 34 + up}};
      for (const cv::Point& place : lower_left) {
        const cv::Rect box(place.x, place.y - height + 2, width, height);
        if (!is_free(box)) continue;
        draw_text(image_, place, text, style);
        taken_.push_back(box);
        return;
      }
    }
  }

 private:
  bool is_free(const cv::Rect& box) const {
    return (box & area_) == box &&
           std::none_of(taken_.begin(), taken_.end(),
                        [&](const cv::Rect& other) { return (box & other).area() > 0; });
  }

  cv::Mat& image_;
  cv::Rect area_;
  std::vector<cv::Rect> taken_;
};

struct Ranges {
  Range x, left, right;
};

Ranges ranges_of(const ChartSpec& spec) {
  Ranges ranges;
  for (const Series& series : spec.series) {
    const Axis& vertical = series.right_axis ? spec.right : spec.y;
    for (const ChartPoint& p : series.points) {
      if (!can_show(p.x, spec.x) || !can_show(p.y, vertical)) continue;
      ranges.x.include(p.x);
      (series.right_axis ? ranges.right : ranges.left).include(p.y);
    }
  }
  return ranges;
}

std::vector<LegendSample> series_legend(const std::vector<Series>& all) {
  std::vector<LegendSample> samples;
  for (const Series& series : all) {
    if (series.legend.empty()) continue;
    const int width = series.line ? kLineWidth : 0;
    samples.push_back(
        {series.legend, {series.colour, width, series.dash_px}, series.marker, false});
  }
  return samples;
}

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

cv::Mat draw_chart(const ChartSpec& spec, cv::Rect* area) {
  cv::Mat image(spec.size, CV_8UC3, palette::kWhite);
  const auto on_the_right = std::find_if(spec.series.begin(), spec.series.end(),
                                         [](const Series& s) { return s.right_axis; });
  const bool has_right = on_the_right != spec.series.end();
  const Ranges ranges = ranges_of(spec);
  draw_titles(image, spec.title, spec.subtitle);
  Frame left;
  left.area = draw_legend(image, series_legend(spec.series), has_right);
  left.x = {spec.x, padded(ranges.x, spec.x)};
  left.y = {spec.y, padded(ranges.left, spec.y)};
  Frame right = left;
  right.y = {spec.right, padded(ranges.right, spec.right)};
  draw_y_axis(image, left);
  draw_x_axis(image, left);
  cv::rectangle(image, left.area, palette::kGrey, 2);
  if (has_right) draw_right_axis(image, right, on_the_right->colour);

  Labels labels(image, left.area);
  std::vector<std::vector<std::vector<Placed>>> runs;  // per series
  for (const Series& series : spec.series) {
    runs.push_back(runs_of(series, series.right_axis ? right : left));
    draw_series(image, series, runs.back());
    if (series.marker == Marker::kNone) continue;
    for (const auto& run : runs.back())
      for (const Placed& p : run) labels.keep_free(p.at);
  }
  for (std::size_t s = 0; s < runs.size(); ++s) {
    for (const auto& run : runs[s]) {
      for (const Placed& p : run) {
        if (!p.point->label.empty()) labels.write(p.point->label, p.at, spec.series[s].colour);
      }
    }
  }
  if (area != nullptr) *area = left.area;
  return image;
}

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
  cv::rectangle(image, frame.area, palette::kGrey, 2);
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
