// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/stereo/pictures.hpp"

#include <fmt/format.h>
#include <glob.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "client/tools/pictures/canvas.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

// A picture of more bytes is no photograph, and a small gzip file may
// stand for any number of them.
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;

bool is_gzip(const std::string& bytes) {
  return bytes.size() > 2 && bytes[0] == '\x1f' && bytes[1] == '\x8b';
}

Result<std::string> gunzip(const fs::path& path) {
  const gzFile file = gzopen(path.c_str(), "rb");
  if (file == nullptr) return io::unreadable(path, "cannot be opened");
  std::string bytes;
  std::array<char, 1 << 16> buffer{};
  int count = 0;
  while ((count = gzread(file, buffer.data(), buffer.size())) > 0 && bytes.size() < kMaxBytes)
    bytes.append(buffer.data(), static_cast<std::size_t>(count));
  const bool whole = count == 0;
  const bool closed = gzclose(file) == Z_OK;
  if (!whole || !closed) return io::unreadable(path, "is a damaged gzip file");
  return bytes;
}

constexpr int kPanelWidth = 900, kMargin = 60, kTop = 110, kBottom = 80, kBarRoom = 260;
// The scale leaves out this fraction at either end, so that a few strays do not flatten the rest.
constexpr double kTail = 0.01;
// A colour bar needs some width even where everything is equally far.
constexpr double kMinSpan = 1.0;

ColourScale scale_of(const stereo::PixelMap<float>& disparity) {
  std::vector<float> values;
  for (const float d : disparity.pixels)
    if (!std::isnan(d)) values.push_back(d);
  if (values.empty()) return {0.0, kMinSpan};
  std::sort(values.begin(), values.end());
  const auto tail = static_cast<std::size_t>(kTail * static_cast<double>(values.size()));
  const auto low = static_cast<double>(values[tail]);
  const auto high = static_cast<double>(values[values.size() - 1 - tail]);
  return {low, std::max(high, low + kMinSpan)};
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

Result<stereo::GrayImage> read_picture(const fs::path& path) {
  auto bytes = io::read_file(path);
  if (bytes && is_gzip(*bytes)) bytes = gunzip(path);
  if (!bytes) return tl::unexpected(bytes.error());
  if (bytes->empty()) return io::unreadable(path, "is empty");
  cv::Mat picture;
  try {
    const cv::Mat raw(1, static_cast<int>(bytes->size()), CV_8UC1, bytes->data());
    picture = cv::imdecode(raw, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (picture.empty() || picture.type() != CV_8UC1)
    return io::unreadable(path, "is no picture that can be read");
  stereo::GrayImage image(picture.cols, picture.rows);
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) image.at(x, y) = picture.at<std::uint8_t>(y, x);
  return image;
}

Result<std::vector<fs::path>> expand_patterns(const std::vector<std::string>& names) {
  std::vector<fs::path> files;
  for (const std::string& name : names) {
    glob_t found{};
    const int status = ::glob(name.c_str(), 0, nullptr, &found);
    for (std::size_t i = 0; status == 0 && i < found.gl_pathc; ++i)
      files.emplace_back(found.gl_pathv[i]);
    ::globfree(&found);
    if (status != 0) return fail(ErrorCode::kNotFound, name + ": no file of this name or pattern");
  }
  return files;
}

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
    return io::write_failed(path, "the picture cannot be encoded");
  return io::write_file(path, {reinterpret_cast<const char*>(png.data()), png.size()});
}

}  // namespace brainshift::client
