// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/axes.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace brainshift::client {
namespace {

constexpr int kLeftMargin = 190;
constexpr int kRightMargin = 60;
constexpr int kRightAxisMargin = 160;
constexpr int kBottomMargin = 130;
constexpr int kTextLeft = 60;
constexpr int kFirstLegendY = 160;
constexpr int kAxesLegendRow = 46;
constexpr int kBelowLegend = 40;
constexpr int kSample = 60;  // width of a legend's line or bar
constexpr int kSampleGap = 14;
constexpr int kEntryGap = 44;

struct Tick {
  double value = 0.0;
  std::string text;
};

std::vector<Tick> ticks_of(const Scale& scale) {
  const auto& [min, max] = scale.range;
  std::vector<double> values = scale.axis.log ? log_ticks(min, max) : nice_ticks(min, max);
  if (scale.axis.counts) {
    std::erase_if(values, [](double v) { return std::abs(v - std::round(v)) > 1e-9; });
  }
  const double step = values.size() > 1 ? values[1] - values[0] : 1.0;
  std::vector<Tick> ticks;
  for (const double value : values) {
    ticks.push_back({value, scale.axis.log ? log_tick_label(value) : tick_label(value, step)});
  }
  return ticks;
}

int row_of(const Frame& frame, double value) {
  return static_cast<int>(std::lround(frame(frame.x.range.min, value).y));
}

}  // namespace

bool can_show(double value, const Axis& axis) {
  return std::isfinite(value) && (!axis.log || value > 0.0);
}

void Range::include(double value) {
  *this = empty() ? Range{value, value} : Range{std::min(min, value), std::max(max, value)};
}

Range padded(const Range& data, const Axis& axis) {
  if (data.empty()) return axis.log ? Range{0.1, 10.0} : Range{0.0, 1.0};
  if (axis.log) {
    const double pad = std::pow(std::max(data.max / data.min, 1.2), 0.07);
    return {data.min / pad, data.max * pad};
  }
  const bool starts_at_zero = axis.from_zero && data.min >= 0.0;
  const double pad = 0.06 * (data.max > data.min ? data.max - data.min : std::abs(data.max) + 1.0);
  return {starts_at_zero ? 0.0 : data.min - pad, data.max + pad};
}

cv::Point2d Frame::operator()(double vx, double vy) const {
  return {
      area.x + axis_fraction(vx, x.range.min, x.range.max, x.axis.log) * area.width,
      area.y + area.height - axis_fraction(vy, y.range.min, y.range.max, y.axis.log) * area.height};
}

void draw_titles(cv::Mat& image, const std::string& title, const std::string& subtitle) {
  draw_text(image, {kTextLeft, 62}, title, {.cap_px = 28.0, .bold = true});
  draw_text(image, {kTextLeft, 106}, subtitle, {.cap_px = 19.0, .colour = palette::kGrey});
}

cv::Rect draw_legend(cv::Mat& image, const std::vector<LegendSample>& samples, bool right_axis) {
  int x = kTextLeft, y = kFirstLegendY;
  for (const LegendSample& sample : samples) {
    const int width = kSample + kSampleGap + text_width(sample.name, {}) + kEntryGap;
    if (x > kTextLeft && x + width > image.cols - 20) {
      x = kTextLeft;
      y += kAxesLegendRow;
    }
    if (sample.bar) {
      cv::rectangle(image, cv::Rect(x, y - 12, kSample, 24), sample.stroke.colour, cv::FILLED);
    } else if (sample.stroke.thickness > 0) {
      draw_polyline(image, {cv::Point2d(x, y), cv::Point2d(x + kSample, y)}, sample.stroke);
    }
    draw_marker(image, {x + 0.5 * kSample, static_cast<double>(y)}, sample.marker,
                sample.stroke.colour, kMarkerRadius);
    draw_text(image, {x + kSample + kSampleGap, y + 10}, sample.name);
    x += width;
  }
  const int top = y + kBelowLegend;
  const int right = right_axis ? kRightAxisMargin : kRightMargin;
  return {kLeftMargin, top, image.cols - kLeftMargin - right, image.rows - top - kBottomMargin};
}

void draw_x_axis(cv::Mat& image, const Frame& frame) {
  const cv::Rect& area = frame.area;
  const int bottom = area.y + area.height;
  for (const Tick& tick : ticks_of(frame.x)) {
    const int x = static_cast<int>(std::lround(frame(tick.value, frame.y.range.min).x));
    cv::line(image, {x, area.y}, {x, bottom + 10}, palette::kPale, 2);
    draw_text(image, {x, bottom + 42}, tick.text, {.align = Align::kCentre});
  }
  draw_text(image, {area.x + area.width / 2, bottom + 96}, frame.x.axis.label,
            {.cap_px = 21.0, .align = Align::kCentre});
}

void draw_y_axis(cv::Mat& image, const Frame& frame) {
  const cv::Rect& area = frame.area;
  for (const Tick& tick : ticks_of(frame.y)) {
    const int y = row_of(frame, tick.value);
    cv::line(image, {area.x, y}, {area.x + area.width, y}, palette::kPale, 2);
    draw_text(image, {area.x - 14, y + 10}, tick.text, {.align = Align::kRight});
  }
  draw_vertical_text(image, {48, area.y + area.height / 2}, frame.y.axis.label, {.cap_px = 21.0});
}

void draw_right_axis(cv::Mat& image, const Frame& frame, const cv::Scalar& colour) {
  const int right = frame.area.x + frame.area.width;
  for (const Tick& tick : ticks_of(frame.y)) {
    const int y = row_of(frame, tick.value);
    cv::line(image, {right, y}, {right + 10, y}, colour, 2);
    draw_text(image, {right + 18, y + 10}, tick.text, {.colour = colour});
  }
  draw_vertical_text(image, {image.cols - 36, frame.area.y + frame.area.height / 2},
                     frame.y.axis.label, {.cap_px = 21.0, .colour = colour});
}

}  // namespace brainshift::client
