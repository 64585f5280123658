// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/stability/verdict_map.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "client/tools/pictures/canvas.hpp"
#include "client/tools/pictures/ticks.hpp"

namespace brainshift::stability {
namespace {

namespace palette = client::palette;
using client::Align;
using client::Marker;

constexpr int kWidth = 1800;
constexpr int kLeft = 520;  // row labels
constexpr int kRight = 60;
constexpr int kTop = 210;
constexpr int kRowHeight = 50;
constexpr int kBelowPanel = 150;
constexpr int kRadius = 13;
// Wider than this and an axis is logarithmic.
constexpr double kLogRatio = 30.0;

// A colour and a shape each, so that either tells.
void draw_verdict(cv::Mat& image, cv::Point2d at, Verdict verdict) {
  switch (verdict) {
    case Verdict::kGreen:
      return client::draw_marker(image, at, Marker::kCircle, palette::kGreen, kRadius);
    case Verdict::kYellow:
      client::draw_marker(image, at, Marker::kTriangle, palette::kInk, kRadius + 3);
      return client::draw_marker(image, at, Marker::kTriangle, palette::kYellow, kRadius);
    case Verdict::kGrey:
      return client::draw_marker(image, at, Marker::kSquare, palette::kGrey, kRadius - 1);
    case Verdict::kRed:
      for (const double s : {-1.0, 1.0}) {
        client::draw_polyline(
            image,
            {at + cv::Point2d(-kRadius, -s * kRadius), at + cv::Point2d(kRadius, s * kRadius)},
            {palette::kVermillion, 8});
      }
  }
}

const char* meaning(Verdict verdict) {
  switch (verdict) {
    case Verdict::kGreen: return "accurate";
    case Verdict::kYellow: return "answered with a warning";
    case Verdict::kGrey: return "refused with a reason";
    case Verdict::kRed: return "wrong without saying so";
  }
  return "";
}

struct Panel {
  std::string parameter;
  std::vector<std::string> rows;
  double min = 0.0, max = 1.0;
  bool log = false;

  int height() const { return kRowHeight * static_cast<int>(rows.size()) + kBelowPanel; }
};

std::vector<Panel> panels_of(const std::vector<Point>& points) {
  std::vector<Panel> panels;
  for (const Point& point : points) {
    auto panel = std::find_if(panels.begin(), panels.end(),
                              [&](const Panel& p) { return p.parameter == point.parameter; });
    if (panel == panels.end()) {
      panels.push_back({point.parameter, {}, point.x, point.x, false});
      panel = panels.end() - 1;
    }
    if (std::find(panel->rows.begin(), panel->rows.end(), point.row) == panel->rows.end()) {
      panel->rows.push_back(point.row);
    }
    panel->min = std::min(panel->min, point.x);
    panel->max = std::max(panel->max, point.x);
  }
  for (Panel& panel : panels) {
    panel.log = panel.min > 0.0 && panel.max > kLogRatio * panel.min;
    if (panel.log) {
      const double pad = std::pow(panel.max / panel.min, 0.03);
      panel.min /= pad;
      panel.max *= pad;
    } else {
      const double pad = 0.03 * std::max(panel.max - panel.min, 1e-6);
      panel.min -= pad;
      panel.max += pad;
    }
  }
  return panels;
}

void draw_legend(cv::Mat& image, const std::vector<Point>& points) {
  int x = 70;
  for (const Verdict verdict : kVerdicts) {
    const auto count = std::count_if(points.begin(), points.end(),
                                     [&](const Point& p) { return judge(p) == verdict; });
    const std::string text = std::to_string(count) + " " + meaning(verdict);
    draw_verdict(image, cv::Point2d(x, 140), verdict);
    client::draw_text(image, {x + 28, 150}, text);
    x += 28 + client::text_width(text, {}) + 60;
  }
}

void draw_panel(cv::Mat& image, const Panel& panel, int top, const std::vector<Point>& points) {
  const cv::Rect area(kLeft, top, kWidth - kLeft - kRight,
                      kRowHeight * static_cast<int>(panel.rows.size()));
  const int bottom = area.y + area.height;
  const auto place = [&](double x) {
    return area.x + client::axis_fraction(x, panel.min, panel.max, panel.log) * area.width;
  };
  std::vector<double> ticks = panel.log ? client::log_ticks(panel.min, panel.max)
                                        : client::nice_ticks(panel.min, panel.max);
  const std::size_t every = panel.log ? 1 + (ticks.size() - 1) / 11 : 1;
  for (std::size_t i = 0; i < ticks.size(); i += every) {
    const int x = static_cast<int>(std::lround(place(ticks[i])));
    cv::line(image, {x, area.y}, {x, bottom + 8}, palette::kPale, 2);
    client::draw_text(image, {x, bottom + 38},
                      panel.log ? client::log_tick_label(ticks[i])
                                : client::tick_label(ticks[i], ticks[1] - ticks[0]),
                      {.cap_px = 17.0, .align = Align::kCentre});
  }
  for (std::size_t row = 0; row < panel.rows.size(); ++row) {
    const int y = area.y + kRowHeight * static_cast<int>(row) + kRowHeight / 2;
    client::draw_text(image, {kLeft - 20, y + 8}, panel.rows[row],
                      {.cap_px = 17.0, .align = Align::kRight});
    if (row > 0) {
      cv::line(image, {area.x, y - kRowHeight / 2}, {area.x + area.width, y - kRowHeight / 2},
               palette::kPale, 1);
    }
    // Red last, so that nothing hides it.
    for (const Verdict verdict : kVerdicts) {
      for (const Point& point : points) {
        if (point.parameter != panel.parameter || point.row != panel.rows[row] ||
            judge(point) != verdict) {
          continue;
        }
        draw_verdict(image, cv::Point2d(place(point.x), y), verdict);
      }
    }
  }
  cv::rectangle(image, area, palette::kGrey, 2);
  client::draw_text(image, {area.x + area.width / 2, bottom + 84}, panel.parameter,
                    {.cap_px = 20.0, .align = Align::kCentre});
}

}  // namespace

cv::Mat draw_map(const std::string& sheet, const std::string& title,
                 const std::vector<Point>& all) {
  std::vector<Point> points;
  std::copy_if(all.begin(), all.end(), std::back_inserter(points),
               [&](const Point& p) { return p.sheet == sheet; });
  const std::vector<Panel> panels = panels_of(points);
  int height = kTop;
  for (const Panel& panel : panels) height += panel.height();
  cv::Mat image(cv::Size(kWidth, height), CV_8UC3, palette::kWhite);
  client::draw_text(image, {60, 66}, title, {.cap_px = 28.0, .bold = true});
  draw_legend(image, points);
  int top = kTop;
  for (const Panel& panel : panels) {
    draw_panel(image, panel, top, points);
    top += panel.height();
  }
  return image;
}

}  // namespace brainshift::stability
