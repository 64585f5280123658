// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/plot/chart.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <sstream>

namespace brainshift::client {
namespace {

constexpr int kLeftMargin = 160;
constexpr int kRightMargin = 160;
constexpr int kTopMargin = 200;
constexpr int kBottomMargin = 130;
constexpr int kLegendY = 160;
constexpr int kMarkerRim = 10;

struct Range {
  double min = 0.0;
  double max = 1.0;
};

// Maps values to pixels of the data area.
struct Mapping {
  cv::Rect area;
  Range x;
  Range y;
  cv::Point2d operator()(double vx, double vy) const {
    return {area.x + (vx - x.min) / (x.max - x.min) * area.width,
            area.y + area.height - (vy - y.min) / (y.max - y.min) * area.height};
  }
};

Range padded_from_zero(double max) {
  return {0.0, max > 0.0 && std::isfinite(max) ? 1.08 * max : 1.0};
}

// Whole numbers on an axis that counts.
std::vector<double> axis_ticks(const Range& range, bool counts) {
  std::vector<double> ticks = nice_ticks(range.min, range.max);
  if (counts) {
    std::erase_if(ticks, [](double t) { return std::abs(t - std::round(t)) > 1e-9; });
  }
  return ticks;
}

double step_of(const std::vector<double>& ticks) {
  return ticks.size() > 1 ? ticks[1] - ticks[0] : 1.0;
}

void draw_titles(cv::Mat& image, const std::string& title, const std::string& subtitle) {
  draw_text(image, {60, 62}, title, {.cap_px = 28.0, .bold = true});
  draw_text(image, {60, 106}, subtitle, {.cap_px = 19.0, .colour = palette::kGrey});
}

void draw_frame(cv::Mat& image, const cv::Rect& area) {
  cv::rectangle(image, area, palette::kGrey, 2);
}

void draw_left_axis(cv::Mat& image, const Mapping& map, const std::vector<double>& ticks,
                    const std::string& label) {
  const double step = step_of(ticks);
  for (const double tick : ticks) {
    const int y = static_cast<int>(std::lround(map(map.x.min, tick).y));
    cv::line(image, {map.area.x, y}, {map.area.x + map.area.width, y}, palette::kPale, 2);
    draw_text(image, {map.area.x - 14, y + 10}, tick_label(tick, step), {.align = Align::kRight});
  }
  draw_vertical_text(image, {48, map.area.y + map.area.height / 2}, label, {.cap_px = 21.0});
}

void draw_right_axis(cv::Mat& image, const Mapping& map, const std::vector<double>& ticks,
                     const std::string& label, const cv::Scalar& colour) {
  const int right = map.area.x + map.area.width;
  const double step = step_of(ticks);
  for (const double tick : ticks) {
    const int y = static_cast<int>(std::lround(map(map.x.min, tick).y));
    cv::line(image, {right, y}, {right + 10, y}, colour, 2);
    draw_text(image, {right + 18, y + 10}, tick_label(tick, step), {.colour = colour});
  }
  draw_vertical_text(image, {image.cols - 36, map.area.y + map.area.height / 2}, label,
                     {.cap_px = 21.0, .colour = colour});
}

void draw_x_axis(cv::Mat& image, const Mapping& map, const std::vector<double>& ticks,
                 const std::string& label) {
  const int bottom = map.area.y + map.area.height;
  const double step = step_of(ticks);
  for (const double tick : ticks) {
    const int x = static_cast<int>(std::lround(map(tick, map.y.min).x));
    cv::line(image, {x, bottom}, {x, bottom + 10}, palette::kGrey, 2);
    draw_text(image, {x, bottom + 42}, tick_label(tick, step), {.align = Align::kCentre});
  }
  draw_text(image, {map.area.x + map.area.width / 2, bottom + 96}, label,
            {.cap_px = 21.0, .align = Align::kCentre});
}

void draw_series(cv::Mat& image, const Mapping& map, const Series& series) {
  assert(series.x.size() == series.y.size());
  // Clips to the data area and a rim for the markers of extreme values.
  const cv::Rect clip(map.area.x - kMarkerRim, map.area.y - kMarkerRim,
                      map.area.width + 2 * kMarkerRim, map.area.height + 2 * kMarkerRim);
  cv::Mat inside = image(clip);
  Mapping local = map;
  local.area.x = kMarkerRim;
  local.area.y = kMarkerRim;
  std::vector<cv::Point2d> run;
  const auto flush = [&] {
    draw_polyline(inside, run, {series.colour, 5, series.dash_px});
    run.clear();
  };
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (!std::isfinite(series.y[i])) {
      flush();
      continue;
    }
    const cv::Point2d p = local(series.x[i], series.y[i]);
    run.push_back(p);
    draw_marker(inside, p, series.marker, series.colour);
  }
  flush();
}

// One row of samples with their names; returns the x where the next entry starts.
int draw_legend_entry(cv::Mat& image, int x, const std::string& name, const Stroke& stroke,
                      Marker marker) {
  draw_polyline(image, {cv::Point2d(x, kLegendY), cv::Point2d(x + 70, kLegendY)}, stroke);
  draw_marker(image, {x + 35.0, static_cast<double>(kLegendY)}, marker, stroke.colour);
  const TextStyle style{};
  draw_text(image, {x + 84, kLegendY + 10}, name, style);
  return x + 84 + text_width(name, style) + 48;
}

Range x_range(const std::vector<Series>& series) {
  Range range{0.0, 1.0};
  bool any = false;
  for (const Series& s : series) {
    for (const double x : s.x) {
      range.min = any ? std::min(range.min, x) : x;
      range.max = any ? std::max(range.max, x) : x;
      any = true;
    }
  }
  if (range.max <= range.min) range.max = range.min + 1.0;
  const double margin = 0.02 * (range.max - range.min);
  return {range.min - margin, range.max + margin};
}

double largest(const std::vector<Series>& series, bool right_axis) {
  double max = 0.0;
  for (const Series& s : series) {
    if (s.right_axis != right_axis) continue;
    for (const double y : s.y) {
      if (std::isfinite(y)) max = std::max(max, y);
    }
  }
  return max;
}

}  // namespace

cv::Mat draw_chart(const ChartSpec& spec, cv::Rect* area_out) {
  cv::Mat image(spec.size, CV_8UC3, palette::kWhite);
  const cv::Rect area(kLeftMargin, kTopMargin, spec.size.width - kLeftMargin - kRightMargin,
                      spec.size.height - kTopMargin - kBottomMargin);
  double left_max = largest(spec.series, false);
  for (const ReferenceLine& line : spec.references) left_max = std::max(left_max, line.y);
  const Mapping left{area, x_range(spec.series), padded_from_zero(left_max)};
  Mapping right = left;
  right.y = padded_from_zero(largest(spec.series, true));

  draw_titles(image, spec.title, spec.subtitle);
  draw_left_axis(image, left, axis_ticks(left.y, false), spec.left_label);
  draw_x_axis(image, left, axis_ticks(left.x, true), spec.x_label);
  draw_frame(image, area);
  int legend_x = 60;
  for (const ReferenceLine& line : spec.references) {
    const Stroke stroke{line.colour, 3, 6.0};
    draw_polyline(image, {left(left.x.min, line.y), left(left.x.max, line.y)}, stroke);
  }
  for (const Series& series : spec.series) {
    if (series.right_axis) {
      draw_right_axis(image, right, axis_ticks(right.y, true), spec.right_label, series.colour);
    }
    draw_series(image, series.right_axis ? right : left, series);
    legend_x = draw_legend_entry(image, legend_x, series.legend, {series.colour, 5, series.dash_px},
                                 series.marker);
  }
  for (const ReferenceLine& line : spec.references) {
    legend_x =
        draw_legend_entry(image, legend_x, line.legend, {line.colour, 3, 6.0}, Marker::kNone);
  }
  if (area_out != nullptr) *area_out = area;
  return image;
}

namespace {

void draw_bar(cv::Mat& image, const Mapping& map, const cv::Rect2d& slot, double value,
              const BarSeries& series, int decimals, bool figures) {
  const double shown = std::clamp(value, map.y.min, map.y.max);
  const double base = map(0.0, std::clamp(0.0, map.y.min, map.y.max)).y;
  const double tip = map(0.0, shown).y;
  const cv::Point corner(static_cast<int>(slot.x),
                         static_cast<int>(std::lround(std::min(base, tip))));
  const cv::Size size(static_cast<int>(slot.width),
                      std::max(1, static_cast<int>(std::lround(std::abs(base - tip)))));
  cv::rectangle(image, cv::Rect(corner, size), series.colour, cv::FILLED);
  if (!figures) return;
  // The figure stands at the bar's foot, where no reference mark can hide it.
  const std::string text = fixed_decimals(value, decimals);
  const TextStyle style{.align = Align::kCentre};
  const cv::Point at(static_cast<int>(slot.x + slot.width / 2), static_cast<int>(base) - 20);
  const int half = text_width(text, style) / 2 + 10;
  cv::rectangle(image, cv::Rect(at.x - half, at.y - 30, 2 * half, 40), palette::kWhite, cv::FILLED);
  draw_text(image, at, text, style);
}

}  // namespace

cv::Mat draw_bars(const BarSpec& spec, cv::Rect* area_out) {
  cv::Mat image(spec.size, CV_8UC3, palette::kWhite);
  const cv::Rect area(kLeftMargin, kTopMargin, spec.size.width - kLeftMargin - 60,
                      spec.size.height - kTopMargin - kBottomMargin);
  const Mapping map{area,
                    {0.0, static_cast<double>(std::max<std::size_t>(1, spec.groups.size()))},
                    {spec.y_min, spec.y_max}};
  draw_titles(image, spec.title, spec.subtitle);
  draw_left_axis(image, map, axis_ticks(map.y, false), spec.y_label);
  draw_frame(image, area);
  if (spec.y_min < 0.0) {
    draw_polyline(image, {map(map.x.min, 0.0), map(map.x.max, 0.0)}, {palette::kInk, 2, 0.0});
  }
  const double group_width = static_cast<double>(area.width) / map.x.max;
  const double bar_width = std::min(
      180.0, 0.8 * group_width / static_cast<double>(std::max<std::size_t>(1, spec.series.size())));
  for (std::size_t g = 0; g < spec.groups.size(); ++g) {
    const double middle = map(static_cast<double>(g) + 0.5, 0.0).x;
    // One line per part of the name: side by side, whole names would run into each other.
    int baseline = area.y + area.height + 36;
    std::istringstream lines(spec.groups[g]);
    for (std::string line; std::getline(lines, line); baseline += 28) {
      draw_text(image, {static_cast<int>(middle), baseline}, line,
                {.cap_px = 17.0, .align = Align::kCentre});
    }
    for (std::size_t s = 0; s < spec.series.size(); ++s) {
      const double offset = static_cast<double>(s) - 0.5 * static_cast<double>(spec.series.size());
      const cv::Rect2d slot(middle + offset * bar_width + 4, 0, bar_width - 8, 0);
      const auto& value = spec.series[s].values.at(g);
      if (value) draw_bar(image, map, slot, *value, spec.series[s], spec.decimals, spec.figures);
      if (s >= spec.references.size() || !spec.references[s].at(g)) continue;
      const double y = map(0.0, std::clamp(*spec.references[s][g], spec.y_min, spec.y_max)).y;
      draw_polyline(image, {{slot.x, y}, {slot.x + slot.width, y}}, {palette::kWhite, 9, 0.0});
      draw_polyline(image, {{slot.x, y}, {slot.x + slot.width, y}}, {palette::kBlack, 4, 0.0});
    }
  }
  int legend_x = 60;
  for (const BarSeries& series : spec.series) {
    cv::rectangle(image, cv::Rect(legend_x, kLegendY - 12, 70, 24), series.colour, cv::FILLED);
    legend_x =
        draw_legend_entry(image, legend_x, series.legend, {series.colour, 1, 0.0}, Marker::kNone);
  }
  if (!spec.references.empty()) {
    draw_legend_entry(image, legend_x, spec.reference_legend, {palette::kBlack, 4, 0.0},
                      Marker::kNone);
  }
  if (area_out != nullptr) *area_out = area;
  return image;
}

}  // namespace brainshift::client
