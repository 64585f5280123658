// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/canvas.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace brainshift::client {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr int kBoldFont = cv::FONT_HERSHEY_DUPLEX;
constexpr double kCapHeight = 21.0;  // of a Hershey capital at scale 1
constexpr int kSubPixelBits = 4;

double scale_of(const TextStyle& style) { return style.cap_px / kCapHeight; }
int font_of(const TextStyle& style) { return style.bold ? kBoldFont : kFont; }
int thickness_of(const TextStyle& style) {
  return std::max(1, static_cast<int>(std::lround(style.cap_px / (style.bold ? 10.0 : 11.0))));
}

cv::Point sub_pixel(cv::Point2d p) {
  return {static_cast<int>(std::lround(p.x * (1 << kSubPixelBits))),
          static_cast<int>(std::lround(p.y * (1 << kSubPixelBits)))};
}

// cv::line's fixed-point coordinates overflow far outside the image; nothing is visible there
// anyway.
bool drawable(cv::Point2d p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::abs(p.x) < 3e4 && std::abs(p.y) < 3e4;
}

void draw_segment(cv::Mat& image, cv::Point2d a, cv::Point2d b, const Stroke& stroke) {
  if (!drawable(a) || !drawable(b)) return;
  cv::line(image, sub_pixel(a), sub_pixel(b), stroke.colour, stroke.thickness, cv::LINE_AA,
           kSubPixelBits);
}

}  // namespace

Result<std::string> encode_png(const std::string& name, const cv::Mat& image) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 6})) {
    return fail(ErrorCode::kInternal, name + ": cannot be encoded as PNG");
  }
  return std::string(bytes.begin(), bytes.end());
}

Result<std::string> encode_webp(const std::string& name, const cv::Mat& image, int most_columns) {
  constexpr int kQuality = 72;
  cv::Mat narrow = image;
  if (image.cols > most_columns) {
    const double factor = static_cast<double>(most_columns) / image.cols;
    cv::resize(image, narrow, {}, factor, factor, cv::INTER_AREA);
  }
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".webp", narrow, bytes, {cv::IMWRITE_WEBP_QUALITY, kQuality})) {
    return fail(ErrorCode::kInternal, name + ": cannot be encoded as WebP");
  }
  return std::string(bytes.begin(), bytes.end());
}

TextStyle on_picture(double cap_px, bool bold) {
  return {cap_px, palette::kWhite, Align::kCentre, bold, true};
}

int text_width(const std::string& text, const TextStyle& style) {
  int baseline = 0;
  return cv::getTextSize(text, font_of(style), scale_of(style), thickness_of(style), &baseline)
      .width;
}

void draw_text(cv::Mat& image, cv::Point at, const std::string& text, const TextStyle& style) {
  if (style.align == Align::kCentre) at.x -= text_width(text, style) / 2;
  if (style.align == Align::kRight) at.x -= text_width(text, style);
  const int thickness = thickness_of(style);
  if (style.halo) {
    cv::putText(image, text, at, font_of(style), scale_of(style), palette::kBlack, thickness + 4,
                cv::LINE_AA);
  }
  cv::putText(image, text, at, font_of(style), scale_of(style), style.colour, thickness,
              cv::LINE_AA);
}

void draw_vertical_text(cv::Mat& image, cv::Point centre, const std::string& text,
                        const TextStyle& style) {
  const int width = text_width(text, style) + 8;
  const int height = static_cast<int>(2.0 * style.cap_px);
  // A mask of coverage, turned by 90 degrees and painted through.
  cv::Mat mask(height, width, CV_8UC1, cv::Scalar(0));
  TextStyle white = style;
  white.colour = cv::Scalar(255);
  white.align = Align::kLeft;
  white.halo = false;
  draw_text(mask, {4, static_cast<int>(1.5 * style.cap_px)}, text, white);
  cv::rotate(mask, mask, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Rect wanted(centre.x - mask.cols / 2, centre.y - mask.rows / 2, mask.cols, mask.rows);
  const cv::Rect visible = wanted & cv::Rect(0, 0, image.cols, image.rows);
  for (int y = visible.y; y < visible.y + visible.height; ++y) {
    for (int x = visible.x; x < visible.x + visible.width; ++x) {
      const double cover = mask.at<std::uint8_t>(y - wanted.y, x - wanted.x) / 255.0;
      cv::Vec3b& pixel = image.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c) {
        pixel[c] =
            cv::saturate_cast<std::uint8_t>((1.0 - cover) * pixel[c] + cover * style.colour[c]);
      }
    }
  }
}

void draw_polyline(cv::Mat& image, const std::vector<cv::Point2d>& points, const Stroke& stroke) {
  if (stroke.rim > 0) {
    draw_polyline(image, points, {palette::kBlack, stroke.thickness + 2 * stroke.rim, 0.0});
  }
  double travelled = 0.0;  // along the line, so that dashes run on through corners
  for (std::size_t i = 1; i < points.size(); ++i) {
    const cv::Point2d a = points[i - 1];
    const cv::Point2d step = points[i] - a;
    const double length = cv::norm(step);
    if (stroke.dash_px <= 0.0 || !drawable(a) || !drawable(points[i])) {
      draw_segment(image, a, points[i], stroke);
      continue;
    }
    for (double s = 0.0; s < length;) {
      const double phase = std::fmod(travelled + s, 2.0 * stroke.dash_px);
      const bool pen_down = phase < stroke.dash_px;
      const double next = pen_down ? stroke.dash_px : 2.0 * stroke.dash_px;
      const double end = std::min(length, s + std::max(next - phase, 1e-3));
      if (pen_down) draw_segment(image, a + step * (s / length), a + step * (end / length), stroke);
      s = end;
    }
    travelled += length;
  }
}

void draw_arrow(cv::Mat& image, cv::Point2d from, cv::Point2d to, const Stroke& stroke,
                double head_px, int rim) {
  const cv::Point2d along = to - from;
  const double length = cv::norm(along);
  if (!drawable(from) || !drawable(to) || length < 1.0) return;
  const double head = std::min(head_px, 0.45 * length);
  const cv::Point2d unit = along / length;
  const cv::Point2d side(-unit.y, unit.x);
  const auto draw = [&](const Stroke& pen) {
    draw_segment(image, from, to, pen);
    draw_segment(image, to, to - head * unit + 0.5 * head * side, pen);
    draw_segment(image, to, to - head * unit - 0.5 * head * side, pen);
  };
  if (rim > 0) draw({palette::kBlack, stroke.thickness + 2 * rim, 0.0});
  draw(stroke);
}

void draw_marker(cv::Mat& image, cv::Point2d at, Marker marker, const cv::Scalar& colour,
                 int radius) {
  if (!drawable(at)) return;
  const cv::Point p(static_cast<int>(std::lround(at.x)), static_cast<int>(std::lround(at.y)));
  switch (marker) {
    case Marker::kNone: return;
    case Marker::kCircle: cv::circle(image, p, radius, colour, cv::FILLED, cv::LINE_AA); return;
    case Marker::kSquare:
      cv::rectangle(image, p - cv::Point(radius, radius) * 0.9, p + cv::Point(radius, radius) * 0.9,
                    colour, cv::FILLED, cv::LINE_AA);
      return;
    case Marker::kTriangle: {
      const std::vector<cv::Point> corners = {{p.x, p.y - radius - 2},
                                              {p.x + radius + 1, p.y + radius - 1},
                                              {p.x - radius - 1, p.y + radius - 1}};
      cv::fillConvexPoly(image, corners, colour, cv::LINE_AA);
      return;
    }
  }
}

cv::Scalar magnitude_colour(double t) {
  static const cv::Mat table = [] {
    cv::Mat ramp(1, 256, CV_8UC1);
    for (int i = 0; i < 256; ++i) ramp.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
    cv::Mat colours;
    cv::applyColorMap(ramp, colours, cv::COLORMAP_VIRIDIS);
    return colours;
  }();
  const double clamped = std::isfinite(t) ? std::clamp(t, 0.0, 1.0) : 0.0;
  const cv::Vec3b& c =
      table.at<cv::Vec3b>(0, static_cast<int>(std::lround(64.0 + 191.0 * clamped)));
  return {static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])};
}

void draw_colour_bar(cv::Mat& image, const cv::Rect& bar, const ColourScale& scale,
                     const std::string& label, const cv::Scalar& ink) {
  for (int y = 0; y < bar.height; ++y) {
    const double t = 1.0 - static_cast<double>(y) / std::max(1, bar.height - 1);
    cv::line(image, {bar.x, bar.y + y}, {bar.x + bar.width - 1, bar.y + y}, magnitude_colour(t));
  }
  cv::rectangle(image, bar, ink, 2);
  const TextStyle style{.cap_px = 20.0, .colour = ink};
  const std::vector<double> ticks = nice_ticks(scale.min, scale.max, 6);
  const double step = ticks.size() > 1 ? ticks[1] - ticks[0] : scale.max - scale.min;
  int widest = 0;
  for (const double tick : ticks) {
    const double t = (tick - scale.min) / (scale.max - scale.min);
    const int y = bar.y + bar.height - 1 - static_cast<int>(std::lround(t * (bar.height - 1)));
    const int right = bar.x + bar.width;
    cv::line(image, {right, y}, {right + 8, y}, ink, 2);
    const std::string text = tick_label(tick, step);
    draw_text(image, {right + 16, y + 10}, text, style);
    widest = std::max(widest, text_width(text, style));
  }
  draw_vertical_text(image, {bar.x + bar.width + 16 + widest + 36, bar.y + bar.height / 2}, label,
                     style);
}

double axis_fraction(double value, double min, double max, bool log) {
  assert(min < max && (!log || min > 0.0));
  return log ? std::log(value / min) / std::log(max / min) : (value - min) / (max - min);
}

std::vector<double> nice_ticks(double min, double max, int target) {
  assert(min < max && target >= 1);
  const double rough = (max - min) / target;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough * (1.0 - 1e-9)) {
      step = factor * power;
      break;
    }
  }
  std::vector<double> ticks;
  const auto first = static_cast<long>(std::ceil(min / step - 1e-9));
  const auto last = static_cast<long>(std::floor(max / step + 1e-9));
  for (long k = first; k <= last; ++k) ticks.push_back(static_cast<double>(k) * step);
  return ticks;
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

std::string fixed_decimals(double value, int decimals) {
  return fmt::format("{:.{}f}", value, decimals);
}

std::string tick_label(double value, double step) {
  const int decimals =
      step > 0.0 ? std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 6) : 0;
  return fixed_decimals(std::abs(value) < 1e-9 * std::abs(step) ? 0.0 : value, decimals);
}

std::string log_tick_label(double value) {
  const std::string text = fmt::format("{:.4g}", value);
  const bool exponent = text.find('e') != std::string::npos;
  return exponent && value >= 1.0 && value < 1e6 ? fixed_decimals(value, 0) : text;
}

void draw_gravity_arrow(cv::Mat& image, cv::Point2d along) {
  constexpr double kHalf_px = 44.0;
  constexpr double kMinSeen = 0.1;
  const TextStyle style = on_picture(18.0);
  const cv::Point2d centre(86.0, 100.0);
  draw_text(image, {static_cast<int>(centre.x), 34}, "gravity", style);
  if (cv::norm(along) < kMinSeen) {
    draw_text(image, {static_cast<int>(centre.x), 66}, "along view", style);
    return;
  }
  const cv::Point2d half = kHalf_px * along;
  draw_arrow(image, centre - half, centre + half, {palette::kWhite, 5, 0.0}, 22.0, 3);
}

}  // namespace brainshift::client
