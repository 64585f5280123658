// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/plot/xy_chart.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

namespace brainshift::client {
namespace {

constexpr int kLeftMargin = 190;
constexpr int kRightMargin = 60;
constexpr int kBottomMargin = 130;
constexpr int kFirstLegendY = 160;
constexpr int kLegendRow = 46;
constexpr int kLegendSample = 60;
constexpr double kLabelCap = 17.0;

struct Range {
  double min = 1.0;
  double max = 0.0;
  bool empty() const { return max < min; }
  void include(double value) {
    if (empty()) {
      min = max = value;
    } else {
      min = std::min(min, value);
      max = std::max(max, value);
    }
  }
};

bool drawable(double value, const XyAxis& axis) {
  return std::isfinite(value) && (!axis.log || value > 0.0);
}

// Room around the data; a linear axis of values >= 0 starts at 0.
Range padded(Range range, bool log) {
  if (range.empty()) return log ? Range{0.1, 10.0} : Range{0.0, 1.0};
  if (log) {
    const double ratio = std::max(range.max / range.min, 1.2);
    const double pad = std::pow(ratio, 0.07);
    return {range.min / pad, range.max * pad};
  }
  const double span = range.max > range.min ? range.max - range.min : std::abs(range.max) + 1.0;
  return {range.min >= 0.0 ? 0.0 : range.min - 0.06 * span, range.max + 0.06 * span};
}

struct Frame {
  cv::Rect area;
  Range x, y;
  bool log_x = false, log_y = false;
  cv::Point2d operator()(double vx, double vy) const {
    return {area.x + axis_fraction(vx, x.min, x.max, log_x) * area.width,
            area.y + area.height - axis_fraction(vy, y.min, y.max, log_y) * area.height};
  }
};

std::vector<double> ticks_of(const Range& range, bool log) {
  return log ? log_ticks(range.min, range.max) : nice_ticks(range.min, range.max);
}

std::vector<std::string> tick_labels(const std::vector<double>& ticks, bool log) {
  std::vector<std::string> labels;
  const double step = ticks.size() > 1 ? ticks[1] - ticks[0] : 1.0;
  for (const double tick : ticks)
    labels.push_back(log ? log_tick_label(tick) : tick_label(tick, step));
  return labels;
}

void draw_axes(cv::Mat& image, const Frame& frame, const XyChartSpec& spec) {
  const cv::Rect& area = frame.area;
  const int bottom = area.y + area.height;
  const auto y_ticks = ticks_of(frame.y, frame.log_y);
  const auto y_labels = tick_labels(y_ticks, frame.log_y);
  for (std::size_t i = 0; i < y_ticks.size(); ++i) {
    const int y = static_cast<int>(std::lround(frame(frame.x.min, y_ticks[i]).y));
    cv::line(image, {area.x, y}, {area.x + area.width, y}, palette::kPale, 2);
    draw_text(image, {area.x - 14, y + 10}, y_labels[i], {.align = Align::kRight});
  }
  const auto x_ticks = ticks_of(frame.x, frame.log_x);
  const auto x_labels = tick_labels(x_ticks, frame.log_x);
  for (std::size_t i = 0; i < x_ticks.size(); ++i) {
    const int x = static_cast<int>(std::lround(frame(x_ticks[i], frame.y.min).x));
    cv::line(image, {x, area.y}, {x, bottom + 10}, palette::kPale, 2);
    draw_text(image, {x, bottom + 42}, x_labels[i], {.align = Align::kCentre});
  }
  cv::rectangle(image, area, palette::kGrey, 2);
  draw_vertical_text(image, {48, area.y + area.height / 2}, spec.y.label, {.cap_px = 21.0});
  draw_text(image, {area.x + area.width / 2, bottom + 96}, spec.x.label,
            {.cap_px = 21.0, .align = Align::kCentre});
}

// Draws the legend in as many rows as it needs, or only counts them when `image` is null.
int legend_rows(cv::Mat* image, const XyChartSpec& spec) {
  int rows = 0;
  int x = spec.size.width;  // forces a first row
  for (const XySeries& series : spec.series) {
    if (series.legend.empty()) continue;
    const int width = kLegendSample + 14 + text_width(series.legend, {}) + 44;
    if (x + width > spec.size.width - 20) {
      ++rows;
      x = 60;
    }
    if (image != nullptr) {
      const int y = kFirstLegendY + (rows - 1) * kLegendRow;
      if (series.line) {
        draw_polyline(*image, {cv::Point2d(x, y), cv::Point2d(x + kLegendSample, y)},
                      {series.colour, 4, series.dash_px});
      }
      draw_marker(*image, {x + 0.5 * kLegendSample, static_cast<double>(y)}, series.marker,
                  series.colour, 10);
      draw_text(*image, {x + kLegendSample + 14, y + 10}, series.legend);
    }
    x += width;
  }
  return rows;
}

bool overlaps(const cv::Rect& box, const std::vector<cv::Rect>& taken) {
  return std::any_of(taken.begin(), taken.end(),
                     [&](const cv::Rect& other) { return (box & other).area() > 0; });
}

// Beside the marker, at the first place where it covers no other label or marker and stays in the data area.
void draw_label(cv::Mat& image, const cv::Rect& area, cv::Point2d at, const XyPoint& point,
                const cv::Scalar& colour, std::vector<cv::Rect>& taken) {
  TextStyle style;
  style.cap_px = kLabelCap;
  style.colour = colour;
  const int width = text_width(point.label, style);
  const int height = static_cast<int>(kLabelCap) + 6;
  const cv::Point p(static_cast<int>(at.x), static_cast<int>(at.y));
  std::vector<cv::Point> places;  // lower left corners
  for (const int step : {0, 1, 2, 3}) {
    const int up = step * height;
    places.insert(places.end(), {{p.x + 16, p.y + 8 - up},
                                 {p.x - 16 - width, p.y + 8 - up},
                                 {p.x + 16, p.y + 8 + up},
                                 {p.x - 16 - width, p.y + 8 + up},
                                 {p.x - width / 2, p.y - 18 - up},
                                 {p.x - width / 2, p.y + 34 + up}});
  }
  for (const cv::Point& place : places) {
    const cv::Rect box(place.x, place.y - height + 2, width, height);
    if ((box & area) != box || overlaps(box, taken)) continue;
    draw_text(image, place, point.label, style);
    taken.push_back(box);
    return;
  }
}

void draw_all(cv::Mat& image, const Frame& frame, const XyChartSpec& spec) {
  std::vector<cv::Rect> taken;
  const auto shown = [&](const XyPoint& p) {
    return drawable(p.x, spec.x) && drawable(p.y, spec.y);
  };
  for (const XySeries& series : spec.series) {
    std::vector<cv::Point2d> run;
    for (const XyPoint& p : series.points) {
      if (!shown(p)) continue;
      run.push_back(frame(p.x, p.y));
      const cv::Point centre(static_cast<int>(run.back().x), static_cast<int>(run.back().y));
      if (series.marker != Marker::kNone)
        taken.emplace_back(centre - cv::Point(11, 11), cv::Size(22, 22));
    }
    if (series.line) draw_polyline(image, run, {series.colour, 4, series.dash_px});
    for (const cv::Point2d& p : run) draw_marker(image, p, series.marker, series.colour, 10);
  }
  for (const XySeries& series : spec.series) {
    for (const XyPoint& p : series.points) {
      if (p.label.empty() || !shown(p)) continue;
      draw_label(image, frame.area, frame(p.x, p.y), p, series.colour, taken);
    }
  }
}

}  // namespace

double axis_fraction(double value, double min, double max, bool log) {
  assert(min < max && (!log || min > 0.0));
  return log ? std::log(value / min) / std::log(max / min) : (value - min) / (max - min);
}

std::vector<double> log_ticks(double min, double max) {
  assert(0.0 < min && min < max);
  const auto within = [&](const std::vector<double>& factors) {
    std::vector<double> ticks;
    const int first = static_cast<int>(std::floor(std::log10(min)));
    const int last = static_cast<int>(std::ceil(std::log10(max)));
    for (int exponent = first; exponent <= last; ++exponent) {
      for (const double factor : factors) {
        // By its text, so that 0.001 is the nearest number to 0.001.
        const double tick =
            std::stod(std::to_string(static_cast<int>(factor)) + "e" + std::to_string(exponent));
        if (tick >= min * (1.0 - 1e-12) && tick <= max * (1.0 + 1e-12)) ticks.push_back(tick);
      }
    }
    return ticks;
  };
  std::vector<double> ticks = within({1.0});
  if (ticks.size() < 4) ticks = within({1.0, 2.0, 5.0});
  if (ticks.size() < 3) ticks = nice_ticks(min, max);
  return ticks;
}

std::string log_tick_label(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.4g", value);
  std::string text = buffer;
  if (text.find('e') != std::string::npos && value >= 1.0 && value < 1e6) {
    std::snprintf(buffer, sizeof buffer, "%.0f", value);
    text = buffer;
  }
  return text;
}

cv::Mat draw_xy_chart(const XyChartSpec& spec, cv::Rect* area_out) {
  cv::Mat image(spec.size, CV_8UC3, palette::kWhite);
  Range x, y;
  for (const XySeries& series : spec.series) {
    for (const XyPoint& p : series.points) {
      if (!drawable(p.x, spec.x) || !drawable(p.y, spec.y)) continue;
      x.include(p.x);
      y.include(p.y);
    }
  }
  const int top = kFirstLegendY + 40 + kLegendRow * (std::max(1, legend_rows(nullptr, spec)) - 1);
  Frame frame;
  frame.area = cv::Rect(kLeftMargin, top, spec.size.width - kLeftMargin - kRightMargin,
                        spec.size.height - top - kBottomMargin);
  frame.x = padded(x, spec.x.log);
  frame.y = padded(y, spec.y.log);
  frame.log_x = spec.x.log;
  frame.log_y = spec.y.log;
  draw_text(image, {60, 62}, spec.title, {.cap_px = 28.0, .bold = true});
  draw_text(image, {60, 106}, spec.subtitle, {.cap_px = 19.0, .colour = palette::kGrey});
  legend_rows(&image, spec);
  draw_axes(image, frame, spec);
  draw_all(image, frame, spec);
  if (area_out != nullptr) *area_out = frame.area;
  return image;
}

}  // namespace brainshift::client
