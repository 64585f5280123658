// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

namespace brainshift::client {
namespace {

constexpr const char* kInk = "var(--ink,#1c1c1c)";
constexpr const char* kSoft = "var(--soft,#5a5a5a)";
constexpr const char* kRule = "var(--rule,#d4d4d4)";
constexpr double kCharacter = 6.6;  // mean width at 13 px
constexpr double kUprightLine = 16.0;

std::string colour_of(const cv::Scalar& bgr) {
  if (bgr == palette::kInk || bgr == palette::kBlack) return kInk;
  return fmt::format("#{:02x}{:02x}{:02x}", static_cast<int>(bgr[2]), static_cast<int>(bgr[1]),
                     static_cast<int>(bgr[0]));
}

bool can_show(double value, const Axis& axis) {
  return std::isfinite(value) && (!axis.log || value > 0.0);
}

struct Range {
  double min = 1.0, max = 0.0;
  bool empty() const { return max < min; }
  void include(double value) {
    *this = empty() ? Range{value, value} : Range{std::min(min, value), std::max(max, value)};
  }
};

// With room for markers at its ends; an empty one becomes [0, 1], or [0.1, 10] on a logarithmic
// axis.
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

struct Tick {
  double value = 0.0;
  std::string text;
};

std::vector<Tick> ticks_of(const Axis& axis, const Range& range) {
  std::vector<double> values =
      axis.log ? log_ticks(range.min, range.max) : nice_ticks(range.min, range.max, 5);
  if (axis.counts) {
    std::erase_if(values, [](double v) { return std::abs(v - std::round(v)) > 1e-9; });
  }
  const double step = values.size() > 1 ? values[1] - values[0] : 1.0;
  std::vector<Tick> ticks;
  for (const double value : values) {
    ticks.push_back({value, axis.log ? log_tick_label(value) : tick_label(value, step)});
  }
  return ticks;
}

struct LegendSample {
  std::string name, colour;
  bool line = false, bar = false;
  double dash_px = 0.0;
  Marker marker = Marker::kNone;
};

// Lines of at most `length` pixels, broken at blanks; a longer word has a line of its own.
std::vector<std::string> broken(const std::string& text, double length) {
  std::vector<std::string> lines;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const std::string longer = lines.empty() ? word : lines.back() + " " + word;
    if (!lines.empty() && kCharacter * static_cast<double>(longer.size()) <= length) {
      lines.back() = longer;
    } else {
      lines.push_back(word);
    }
  }
  return lines;
}

// The parts of a chart, in the order in which they are drawn.
class Drawing {
 public:
  explicit Drawing(cv::Size size) : size_(size) {}

  double left = 64.0, right = 0.0, top = 0.0, bottom = 0.0;  // the data area

  void text(double x, double y, const std::string& words, const char* anchor,
            const std::string& colour, const char* more = "") {
    body_ +=
        fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" fill=\"{}\"{}>{}</text>\n",
                    x, y, anchor, colour, more, escape_html(words));
  }
  void upright_text(double x, const std::vector<std::string>& lines, const std::string& colour) {
    const double y = 0.5 * (top + bottom);
    for (const std::string& words : lines) {
      text(x, y, words, "middle", colour,
           fmt::format(" transform=\"rotate(-90 {:.1f} {:.1f})\"", x, y).c_str());
      x += kUprightLine;
    }
  }
  void line(const std::vector<cv::Point2d>& points, const std::string& colour, double width,
            double dash_px = 0.0) {
    body_ +=
        fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"", colour, width);
    if (dash_px > 0.0) body_ += fmt::format(" stroke-dasharray=\"{}\"", dash_px);
    body_ += " points=\"" + list(points) + "\"/>\n";
  }
  void area(const std::vector<cv::Point2d>& points, const std::string& colour) {
    body_ += "<polygon fill=\"" + colour + "\" fill-opacity=\"0.25\" points=\"" + list(points) +
             "\"/>\n";
  }
  void box(double x, double y, double width, double height, const std::string& colour,
           const std::string& title = "") {
    body_ += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"{}>", x, y,
        width, height, colour, title.empty() ? "" : " class=\"hit\"");
    if (!title.empty()) body_ += "<title>" + escape_html(title) + "</title>";
    body_ += "</rect>\n";
  }
  void marker(cv::Point2d at, Marker marker, const std::string& colour) {
    constexpr double kR = 4.0;
    if (marker == Marker::kCircle) {
      body_ += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\"/>\n", at.x,
                           at.y, kR, colour);
    } else if (marker == Marker::kSquare) {
      box(at.x - kR, at.y - kR, 2 * kR, 2 * kR, colour);
    } else if (marker == Marker::kTriangle) {
      body_ += "<polygon fill=\"" + colour + "\" points=\"" +
               list({{at.x, at.y - 5.0}, {at.x - 5.0, at.y + 4.0}, {at.x + 5.0, at.y + 4.0}}) +
               "\"/>\n";
    }
  }

  // Titles and, in rows below them, the legend; the data area is what remains. The labels of its
  // upright axes are broken where they are longer than it is high.
  void head(const std::string& title, const std::string& subtitle,
            const std::vector<LegendSample>& samples, const std::string& y_label,
            const std::string& right_label, double right_margin, double bottom_margin) {
    double y = 8.0;
    if (!title.empty()) text(10.0, y += 14.0, title, "start", kInk, " font-weight=\"600\"");
    if (!subtitle.empty()) text(10.0, y += 18.0, subtitle, "start", kSoft);
    double x = 10.0;
    if (!samples.empty()) y += 22.0;
    for (const LegendSample& sample : samples) {
      const double width = 34.0 + kCharacter * static_cast<double>(sample.name.size()) + 18.0;
      if (x > 10.0 && x + width > size_.width) x = 10.0, y += 20.0;
      if (sample.bar) box(x, y - 10.0, 26.0, 10.0, sample.colour);
      if (sample.line)
        line({{x, y - 5.0}, {x + 26.0, y - 5.0}}, sample.colour, 2.0, sample.dash_px);
      marker({x + 13.0, y - 5.0}, sample.marker, sample.colour);
      text(x + 34.0, y, sample.name, "start", kInk);
      x += width;
    }
    top = y + 14.0;
    bottom = size_.height - bottom_margin;
    y_lines_ = broken(y_label, bottom - top);
    right_lines_ = broken(right_label, bottom - top);
    const auto more = [](const std::vector<std::string>& lines) {
      return kUprightLine * std::max(0.0, static_cast<double>(lines.size()) - 1.0);
    };
    left += more(y_lines_);
    right = size_.width - right_margin - more(right_lines_);
    body_ += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
        "fill=\"none\" stroke=\"{}\"/>\n",
        left, top, right - left, bottom - top, kRule);
  }

  double x_at(double value, const Axis& axis, const Range& range) const {
    return left + axis_fraction(value, range.min, range.max, axis.log) * (right - left);
  }
  double y_at(double value, const Axis& axis, const Range& range) const {
    return bottom - axis_fraction(value, range.min, range.max, axis.log) * (bottom - top);
  }

  void x_axis(const Axis& axis, const Range& range) {
    for (const Tick& tick : ticks_of(axis, range)) {
      const double x = x_at(tick.value, axis, range);
      line({{x, top}, {x, bottom + 4.0}}, kRule, 1.0);
      text(x, bottom + 18.0, tick.text, "middle", kSoft);
    }
    text(0.5 * (left + right), bottom + 38.0, axis.label, "middle", kInk);
  }
  void y_axis(const Axis& axis, const Range& range) {
    for (const Tick& tick : ticks_of(axis, range)) {
      const double y = y_at(tick.value, axis, range);
      line({{left, y}, {right, y}}, kRule, 1.0);
      text(left - 7.0, y + 4.0, tick.text, "end", kSoft);
    }
    upright_text(16.0, y_lines_, kInk);
  }
  void right_axis(const Axis& axis, const Range& range, const std::string& colour) {
    for (const Tick& tick : ticks_of(axis, range)) {
      text(right + 7.0, y_at(tick.value, axis, range) + 4.0, tick.text, "start", colour);
    }
    const double lines = static_cast<double>(right_lines_.size());
    upright_text(size_.width - 10.0 - kUprightLine * (lines - 1.0), right_lines_, colour);
  }

  std::string finish(const std::string& name) const {
    return fmt::format(
               "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" width=\"{}\" "
               "height=\"{}\" role=\"img\" aria-label=\"{}\" font-family=\"system-ui,sans-serif\" "
               "font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" "
               "fill=\"var(--ground,#ffffff)\"/>\n",
               size_.width, size_.height, size_.width, size_.height, escape_html(name)) +
           body_ + "</svg>\n";
  }

 private:
  static std::string list(const std::vector<cv::Point2d>& points) {
    std::string text;
    for (const cv::Point2d& p : points) text += fmt::format("{:.1f},{:.1f} ", p.x, p.y);
    return text;
  }

  cv::Size size_;
  std::string body_;
  std::vector<std::string> y_lines_, right_lines_;
};

std::string value_text(double value) { return fmt::format("{:.3g}", value); }

// Labels beside the markers, each at the first of some places where it covers no other.
void write_labels(Drawing& drawing,
                  const std::vector<std::pair<cv::Point2d, std::string>>& labels) {
  std::vector<cv::Rect2d> taken;
  for (const auto& [at, words] : labels) {
    const double width = kCharacter * static_cast<double>(words.size());
    for (const double down : {0.0, 15.0, -15.0, 30.0, -30.0}) {
      const bool fits = at.x + 8.0 + width < drawing.right;
      const cv::Rect2d box(fits ? at.x + 8.0 : at.x - 8.0 - width, at.y + down - 8.0, width, 14.0);
      if (std::any_of(taken.begin(), taken.end(),
                      [&](const cv::Rect2d& other) { return (box & other).area() > 0.0; })) {
        continue;
      }
      taken.push_back(box);
      drawing.text(box.x, at.y + down + 4.0, words, "start", kSoft);
      break;
    }
  }
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&': escaped += "&amp;"; break;
      case '<': escaped += "&lt;"; break;
      case '>': escaped += "&gt;"; break;
      case '"': escaped += "&quot;"; break;
      case '\'': escaped += "&#39;"; break;
      default: escaped += c;
    }
  }
  return escaped;
}

std::string draw_chart(const ChartSpec& spec) {
  Range x, y, right_y;
  std::vector<LegendSample> samples;
  const Series* on_the_right = nullptr;
  for (const Series& series : spec.series) {
    const Axis& vertical = series.right_axis ? spec.right : spec.y;
    Range& range = series.right_axis ? right_y : y;
    if (series.right_axis && on_the_right == nullptr) on_the_right = &series;
    bool joined = false, before = false;  // a legend shows a line where one is drawn
    for (const ChartPoint& p : series.points) {
      const bool shown = can_show(p.x, spec.x) && can_show(p.y, vertical);
      joined = joined || (shown && before);
      before = shown;
      if (!shown) continue;
      x.include(p.x);
      for (const double end : {p.y - p.sd, p.y + p.sd}) {
        if (can_show(end, vertical)) range.include(end);
      }
    }
    if (series.legend.empty()) continue;
    samples.push_back({series.legend, colour_of(series.colour), series.line && joined, false,
                       series.dash_px, series.marker});
  }
  x = padded(x, spec.x);
  y = padded(y, spec.y);
  right_y = padded(right_y, spec.right);

  Drawing drawing(spec.size);
  drawing.head(spec.title, spec.subtitle, samples, spec.y.label,
               on_the_right != nullptr ? spec.right.label : "",
               on_the_right != nullptr ? 64.0 : 16.0, 46.0);
  drawing.y_axis(spec.y, y);
  drawing.x_axis(spec.x, x);
  if (on_the_right != nullptr) {
    drawing.right_axis(spec.right, right_y, colour_of(on_the_right->colour));
  }
  std::map<double, std::string> titles;  // what stands at a place, by x in pixels
  std::vector<std::pair<cv::Point2d, std::string>> labels;
  for (const Series& series : spec.series) {
    const Axis& vertical = series.right_axis ? spec.right : spec.y;
    const Range& range = series.right_axis ? right_y : y;
    const std::string colour = colour_of(series.colour);
    std::vector<cv::Point2d> run, above, below, all;
    const auto end_run = [&] {
      if (above.size() > 1 && above != below) {
        above.insert(above.end(), below.rbegin(), below.rend());
        drawing.area(above, colour);
      }
      if (series.line && run.size() > 1) drawing.line(run, colour, 2.0, series.dash_px);
      run.clear(), above.clear(), below.clear();
    };
    for (const ChartPoint& p : series.points) {
      if (!can_show(p.x, spec.x) || !can_show(p.y, vertical)) {
        end_run();
        continue;
      }
      const cv::Point2d at(drawing.x_at(p.x, spec.x, x), drawing.y_at(p.y, vertical, range));
      const auto edge = [&](double value) {
        const double shown = std::clamp(value, range.min, range.max);
        return cv::Point2d(at.x, drawing.y_at(shown, vertical, range));
      };
      run.push_back(at), all.push_back(at);
      above.push_back(edge(p.y + p.sd)), below.push_back(edge(p.y - p.sd));
      std::string& title = titles[at.x];
      if (title.empty()) title = spec.x.label + ": " + value_text(p.x);
      title += "\n" + (series.legend.empty() ? vertical.label : series.legend) + ": " +
               value_text(p.y) + (p.sd > 0.0 ? " ± " + value_text(p.sd) : "");
      if (!p.label.empty()) title += ", " + p.label;
      if (!p.note.empty()) title += "\n" + p.note;
      if (!p.label.empty()) labels.emplace_back(at, p.label);
    }
    end_run();
    for (const cv::Point2d& at : all) drawing.marker(at, series.marker, colour);
  }
  write_labels(drawing, labels);
  for (auto column = titles.begin(); column != titles.end(); ++column) {
    const auto next = std::next(column);
    const double from =
        column == titles.begin() ? drawing.left : 0.5 * (std::prev(column)->first + column->first);
    const double to = next == titles.end() ? drawing.right : 0.5 * (column->first + next->first);
    drawing.box(from, drawing.top, to - from, drawing.bottom - drawing.top, "transparent",
                column->second);
  }
  return drawing.finish(spec.title.empty() ? spec.y.label : spec.title);
}

std::string draw_bars(const BarSpec& spec) {
  std::vector<LegendSample> samples;
  for (const BarSeries& series : spec.series) {
    samples.push_back({series.legend, colour_of(series.colour), false, true});
  }
  if (!spec.references.empty()) samples.push_back({spec.reference_legend, kInk, true});
  Drawing drawing(spec.size);
  drawing.head(spec.title, spec.subtitle, samples, spec.y_label, "", 16.0, 58.0);
  const Axis axis{.label = spec.y_label};
  const Range range{spec.y_min, spec.y_max};
  drawing.y_axis(axis, range);
  const auto y_of = [&](double value) {
    return drawing.y_at(std::clamp(value, spec.y_min, spec.y_max), axis, range);
  };
  const double base = y_of(0.0);
  drawing.line({{drawing.left, base}, {drawing.right, base}}, kSoft, 1.0);
  const double groups = static_cast<double>(std::max<std::size_t>(1, spec.groups.size()));
  const double bars = static_cast<double>(std::max<std::size_t>(1, spec.series.size()));
  const double width = (drawing.right - drawing.left) / groups;
  const double pitch = std::min(90.0, 0.8 * width / bars);
  for (std::size_t g = 0; g < spec.groups.size(); ++g) {
    const double middle = drawing.left + (static_cast<double>(g) + 0.5) * width;
    std::istringstream names(spec.groups[g]);
    double below = drawing.bottom;
    std::string title;
    for (std::string name; std::getline(names, name); title += (title.empty() ? "" : ", ") + name) {
      drawing.text(middle, below += 16.0, name, "middle", kInk);
    }
    for (std::size_t s = 0; s < spec.series.size(); ++s) {
      const double x = middle + (static_cast<double>(s) - 0.5 * bars) * pitch + 2.0;
      const auto mark = [&](double value, const std::string& name) {
        title += "\n" + name + ": " + fmt::format("{:.1f}", value);
      };
      if (const auto& value = spec.series[s].values.at(g); value && std::isfinite(*value)) {
        const double tip = y_of(*value);
        drawing.box(x, std::min(base, tip), pitch - 4.0, std::max(1.0, std::abs(base - tip)),
                    colour_of(spec.series[s].colour));
        if (pitch > 34.0) {  // else it has no room; the cursor shows it
          drawing.text(x + 0.5 * pitch - 2.0, std::min(base, tip) - 5.0, fixed_decimals(*value, 1),
                       "middle", kInk);
        }
        mark(*value, spec.series[s].legend);
      }
      if (s >= spec.references.size()) continue;
      if (const auto& reference = spec.references[s].at(g)) {
        drawing.line({{x - 2.0, y_of(*reference)}, {x + pitch - 2.0, y_of(*reference)}}, kInk, 2.5);
        mark(*reference, spec.reference_legend);
      }
    }
    drawing.box(middle - 0.5 * width, drawing.top, width, drawing.bottom - drawing.top,
                "transparent", title);
  }
  return drawing.finish(spec.title);
}

}  // namespace brainshift::client
