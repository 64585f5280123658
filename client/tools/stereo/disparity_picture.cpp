// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/stereo/disparity_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "client/tools/pictures/canvas.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::client {
namespace {

constexpr int kPanelWidth = 900, kMargin = 60, kTop = 110, kBottom = 80, kBarRoom = 260;
// The scale leaves out this fraction at either end, so that a few strays do not flatten the rest.
constexpr double kTail = 0.01;
// A colour bar needs some width even where everything is equally far.
constexpr double kLeastSpan = 1.0;

ColourScale scale_of(const stereo::PixelMap<float>& disparity) {
  std::vector<float> values;
  for (const float d : disparity.pixels)
    if (!std::isnan(d)) values.push_back(d);
  if (values.empty()) return {0.0, kLeastSpan};
  std::sort(values.begin(), values.end());
  const auto tail = static_cast<std::size_t>(kTail * static_cast<double>(values.size()));
  const auto low = static_cast<double>(values[tail]);
  const auto high = static_cast<double>(values[values.size() - 1 - tail]);
  return {low, std::max(high, low + kLeastSpan)};
}

cv::Mat grey_panel(const stereo::GrayImage& picture) {
  cv::Mat panel(picture.height, picture.width, CV_8UC3);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x)
      panel.at<cv::Vec3b>(y, x) = cv::Vec3b::all(picture.at(x, y));
  return panel;
}

cv::Mat colour_panel(const stereo::PixelMap<float>& disparity, const ColourScale& scale) {
  cv::Mat panel(disparity.height, disparity.width, CV_8UC3, cv::Scalar(palette::kPale));
  for (int y = 0; y < disparity.height; ++y) {
    for (int x = 0; x < disparity.width; ++x) {
      const auto d = static_cast<double>(disparity.at(x, y));
      if (std::isnan(d)) continue;
      const cv::Scalar c = magnitude_colour((d - scale.min) / (scale.max - scale.min));
      panel.at<cv::Vec3b>(y, x) =
          cv::Vec3b(cv::saturate_cast<std::uint8_t>(c[0]), cv::saturate_cast<std::uint8_t>(c[1]),
                    cv::saturate_cast<std::uint8_t>(c[2]));
    }
  }
  return panel;
}

void place(cv::Mat& sheet, const cv::Mat& panel, const cv::Rect& where) {
  cv::Mat resized;
  cv::resize(panel, resized, where.size(), 0, 0, cv::INTER_AREA);
  resized.copyTo(sheet(where));
}

}  // namespace

Status write_disparity_picture(const std::filesystem::path& path,
                               const stereo::MeasuredDisparity& measured) {
  const stereo::PixelMap<float>& disparity = measured.map.disparity_px;
  const int height = std::max(1, kPanelWidth * disparity.height / std::max(1, disparity.width));
  const cv::Rect left(kMargin, kTop, kPanelWidth, height);
  const cv::Rect right(2 * kMargin + kPanelWidth, kTop, kPanelWidth, height);
  cv::Mat sheet(kTop + height + kBottom, right.x + right.width + kBarRoom, CV_8UC3,
                cv::Scalar(palette::kWhite));
  const ColourScale scale = scale_of(disparity);
  place(sheet, grey_panel(measured.pair.left), left);
  place(sheet, colour_panel(disparity, scale), right);
  const TextStyle heading{
      .cap_px = 24.0, .colour = palette::kInk, .align = Align::kLeft, .bold = true, .halo = false};
  draw_text(sheet, {left.x, kTop - 36}, "left picture, rectified", heading);
  draw_text(sheet, {right.x, kTop - 36}, "disparity", heading);
  draw_colour_bar(sheet, {right.x + right.width + 30, kTop, 36, height}, scale, "disparity px",
                  palette::kInk);
  draw_text(sheet, {right.x, kTop + height + 48},
            fmt::format("{:.0f} to {:.0f} mm away; {:.0f} % matched; pale: no match",
                        stereo::depth_at(measured.geometry, scale.max),
                        stereo::depth_at(measured.geometry, scale.min),
                        100.0 * measured.map.valid_fraction));
  std::vector<std::uint8_t> png;
  if (!cv::imencode(".png", sheet, png))
    return io::file_error(ErrorCode::kWriteFailed, path, "the picture cannot be encoded");
  return io::write_file(path, {reinterpret_cast<const char*>(png.data()), png.size()});
}

}  // namespace brainshift::client
