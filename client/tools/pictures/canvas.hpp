// SPDX-License-Identifier: GPL-3.0-or-later
// Drawing primitives of charts and pictures: text, lines, arrows, markers, a colour scale, ticks.
//
// Pictures are drawn at kPixelRatio times the size at which a page shows them, so that the stroke
// font stays legible. All lengths here are device pixels; colours are BGR; images are 8-bit BGR.
// The font knows ASCII only: write "deg" and "+/-".
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::client {

inline constexpr int kPixelRatio = 2;

// Okabe and Ito's palette: distinguishable under the common colour-vision deficiencies.
namespace palette {
inline const cv::Scalar kBlack(0, 0, 0);
inline const cv::Scalar kWhite(255, 255, 255);
inline const cv::Scalar kOrange(0, 159, 230);
inline const cv::Scalar kSkyBlue(233, 180, 86);
inline const cv::Scalar kGreen(115, 158, 0);
inline const cv::Scalar kYellow(66, 228, 240);
inline const cv::Scalar kBlue(178, 114, 0);
inline const cv::Scalar kVermillion(0, 94, 213);
inline const cv::Scalar kPurple(167, 121, 204);
inline const cv::Scalar kInk(40, 40, 40);
inline const cv::Scalar kGrey(120, 120, 120);
inline const cv::Scalar kPale(225, 225, 225);
}  // namespace palette

// What a colour stands for in every picture and chart.
namespace meaning {
inline const cv::Scalar kBefore = palette::kWhite;  // as in the MRI; dashed
inline const cv::Scalar kEstimated = palette::kOrange;
inline const cv::Scalar kTrue = palette::kSkyBlue;
inline const cv::Scalar kSeptum = palette::kGreen;
inline const cv::Scalar kVentricle = palette::kVermillion;
inline const cv::Scalar kContact = palette::kBlue;  // boundary conditions
inline const cv::Scalar kFixed = palette::kPurple;
}  // namespace meaning

// An image as the bytes of a PNG file. kInternal; `name` is the file's, for the message.
Result<std::string> encode_png(const std::string& name, const cv::Mat& image);

// The same as a WebP file at most so many pixels wide, made narrower if it is not. It loses what
// the eye does not see, and is a tenth as large.
Result<std::string> encode_webp(const std::string& name, const cv::Mat& image, int most_columns);

enum class Align { kLeft, kCentre, kRight };

struct TextStyle {
  double cap_px = 20.0;  // height of a capital letter
  cv::Scalar colour = palette::kInk;
  Align align = Align::kLeft;
  bool bold = false;
  bool halo = false;  // black rim, for text on images
};

// White and centred, with a halo: for words on pictures of a head.
TextStyle on_picture(double cap_px, bool bold = false);
// Width in pixels.
int text_width(const std::string& text, const TextStyle& style);
// `at` is the baseline's left end, middle or right end, as style.align says.
void draw_text(cv::Mat& image, cv::Point at, const std::string& text, const TextStyle& style = {});
// Reads from bottom to top, centred on `centre`.
void draw_vertical_text(cv::Mat& image, cv::Point centre, const std::string& text,
                        const TextStyle& style = {});

struct Stroke {
  cv::Scalar colour = palette::kInk;
  int thickness = 2;
  double dash_px = 0.0;  // 0: solid; else equal dashes and gaps
  int rim = 0;           // width of a black rim, which parts it from what is as bright
};

// Sub-pixel, anti-aliased. Parts outside the image are clipped.
void draw_polyline(cv::Mat& image, const std::vector<cv::Point2d>& points, const Stroke& stroke);
// `head_px`: length of the barbs, shortened for short arrows. `rim`: width of a black rim, px.
void draw_arrow(cv::Mat& image, cv::Point2d from, cv::Point2d to, const Stroke& stroke,
                double head_px = 16.0, int rim = 0);

enum class Marker { kNone, kCircle, kSquare, kTriangle };
void draw_marker(cv::Mat& image, cv::Point2d at, Marker marker, const cv::Scalar& colour,
                 int radius);

// Viridis without its darkest quarter, which would vanish on an MRI; t is clamped to [0, 1].
cv::Scalar magnitude_colour(double t);

// Vertical bar from min (bottom) to max (top), ticks on its right, a vertical label beyond them.
struct ColourScale {
  double min = 0.0, max = 1.0;  // min < max
};
void draw_colour_bar(cv::Mat& image, const cv::Rect& bar, const ColourScale& scale,
                     const std::string& label, const cv::Scalar& ink);

// Ticks: where those of an axis stand and how they read.
//
// Where a value lies on its axis: 0 at min, 1 at max. log: ln(value / min) / ln(max / min).
// Precondition: min < max; on a logarithmic axis all three are positive.
double axis_fraction(double value, double min, double max, bool log);

// Round positions (1, 2 or 5 times a power of ten apart) within [min, max]; about `target` of
// them. Precondition: min < max.
std::vector<double> nice_ticks(double min, double max, int target = 6);

// Positions on a logarithmic axis within [min, max]: powers of ten. Where there would be fewer
// than four, 2 and 5 times these too. Where that is still fewer than three, those of nice_ticks.
// Precondition: 0 < min < max.
std::vector<double> log_ticks(double min, double max);

// `value` with as many decimals as the step between ticks needs, at most 6.
std::string tick_label(double value, double step);

// Shortest text of a logarithmic tick: "0.002", "5", "20000"; "1e-05" and "1e+06" beyond.
std::string log_tick_label(double value);

// `value` with exactly `decimals` digits after the point.
std::string fixed_decimals(double value, int decimals);

// The arrow named "gravity" in the upper left corner of a picture of a head.
// `along`: the direction of gravity, a unit vector, seen in the picture; pixels run right and down.
// Where gravity is nearly along the line of sight, the words "along view" stand instead.
void draw_gravity_arrow(cv::Mat& image, cv::Point2d along);

}  // namespace brainshift::client
