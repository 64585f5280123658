// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/register_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "client/tools/pictures/canvas.hpp"
#include "client/tools/pictures/sheet.hpp"
#include "client/tools/pictures/slice_panel.hpp"
#include "common/core/statistics.hpp"
#include "common/geometry/mask.hpp"

namespace brainshift::client {
namespace {

constexpr double kPanel_px = 620.0;  // width of a frame
constexpr double kCrossing = 0.866;  // cosine of 30 degrees
constexpr int kRowGap = 16;
constexpr double kBar_mm = 20.0;
constexpr double kTint = 0.8;  // of the brightest echo over the MRI
const cv::Scalar kEchoes = palette::kSkyBlue;
const Stroke kTumourNow{meaning::kEstimated, 4, 0.0};
const Stroke kTumourThen{meaning::kBefore, 4, 12.0};

// A frame of ultrasound as a rectangle in space, in the frame of its pose.
struct FramePlane {
  AffineTransform pose;
  double width_mm = 0.0, height_mm = 0.0, px_per_mm = 1.0;
  Vec3 across, down, normal;  // unit

  cv::Size size() const {
    return {std::max(1, static_cast<int>(std::lround(width_mm * px_per_mm))),
            std::max(1, static_cast<int>(std::lround(height_mm * px_per_mm)))};
  }
  Vec3 place(int x, int y) const {
    return pose.translation() + (x / px_per_mm) * across + (y / px_per_mm) * down;
  }
  cv::Point2d pixel(const Vec3& place) const {
    const Vec3 off = place - pose.translation();
    return {px_per_mm * off.dot(across), px_per_mm * off.dot(down)};
  }
};

FramePlane plane_of(const tracking::Recording& recording, const AffineTransform& pose) {
  FramePlane plane;
  plane.pose = pose;
  plane.across = pose.linear().col(0).normalized();
  plane.down = pose.linear().col(1).normalized();
  plane.normal = plane.across.cross(plane.down).normalized();
  plane.width_mm = (recording.width - 1) * pose.linear().col(0).norm();
  plane.height_mm = (recording.height - 1) * pose.linear().col(1).norm();
  plane.px_per_mm = kPanel_px / std::max(1e-6, plane.width_mm);
  return plane;
}

// Distance from the rectangle to a point.
double distance_mm(const FramePlane& plane, const Vec3& x) {
  const Vec3 off = x - plane.pose.translation();
  const double u = off.dot(plane.across), v = off.dot(plane.down);
  return Vec3(u - std::clamp(u, 0.0, plane.width_mm), v - std::clamp(v, 0.0, plane.height_mm),
              off.dot(plane.normal))
      .norm();
}

// One frame's three pictures: ultrasound; the MRI in its plane before, after.
class FrameRow {
 public:
  FrameRow(const RegisteredUltrasound& done, int frame)
      : done_(done),
        plane_(plane_of(done.recording, *done.poses[static_cast<std::size_t>(frame)])) {
    const Eigen::MatrixXf values = done.recording.frame_values(frame);
    cv::Mat_<float> pixels(static_cast<int>(values.rows()), static_cast<int>(values.cols()));
    for (int v = 0; v < pixels.rows; ++v)
      for (int u = 0; u < pixels.cols; ++u) pixels(v, u) = values(v, u);
    cv::resize(pixels, echo_, plane_.size(), 0.0, 0.0, cv::INTER_LINEAR);
    std::vector<double> seen;
    for (const float value : pixels)
      if (value > 0.0F) seen.push_back(value);
    if (seen.empty()) seen.push_back(0.0);
    middle_ = percentile(seen, 50.0);
    bright_ = std::max(percentile(seen, 99.0), middle_ + 1e-6);
    name_ = fmt::format("frame {}", frame);
  }

  cv::Mat ultrasound() const {
    cv::Mat image(echo_.size(), CV_8UC3, palette::kBlack);
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x) {
        const auto grey = static_cast<unsigned char>(
            std::lround(255.0 * std::clamp(echo_(y, x) / bright_, 0.0, 1.0)));
        image.at<cv::Vec3b>(y, x) = {grey, grey, grey};
      }
    draw_tumour(image, done_.T_before, kTumourThen);
    draw_tumour(image, done_.T_after, kTumourNow);
    const TextStyle style = on_picture(20.0);
    draw_text(image, {16 + text_width(name_, style) / 2, image.rows - 16}, name_, style);
    const cv::Point2d bar(image.cols - 16.0, image.rows - 20.0);
    draw_polyline(image, {bar - cv::Point2d(kBar_mm * plane_.px_per_mm, 0), bar},
                  {palette::kWhite, 5, 0.0});
    draw_text(image, cv::Point(cvRound(bar.x - 0.5 * kBar_mm * plane_.px_per_mm), image.rows - 34),
              fixed_decimals(kBar_mm, 0) + " mm", on_picture(18.0));
    return image;
  }

  // The echoes brighter than the frame's median tint the MRI.
  cv::Mat on_mri(const geometry::Interpolator& mri, double white, const RigidTransform& T) const {
    cv::Mat image(echo_.size(), CV_8UC3, palette::kBlack);
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x) {
        const double grey =
            255.0 * std::clamp(mri(T * plane_.place(x, y)) / white, 0.0, 1.0) * 0.85;
        const double tint =
            kTint * std::clamp((echo_(y, x) - middle_) / (bright_ - middle_), 0.0, 1.0);
        for (int c = 0; c < 3; ++c)
          image.at<cv::Vec3b>(y, x)[c] =
              static_cast<unsigned char>(std::lround((1.0 - tint) * grey + tint * kEchoes[c]));
      }
    draw_tumour(image, T, kTumourNow);
    return image;
  }

  // The MRI's values in the frame, for the grey scale.
  void add_values(const geometry::Interpolator& mri, std::vector<double>& seen) const {
    const cv::Size size = plane_.size();
    for (int y = 0; y < size.height; y += 4)
      for (int x = 0; x < size.width; x += 4)
        if (const double value = mri(done_.T_after * plane_.place(x, y)); value > 0.0)
          seen.push_back(value);
  }

 private:
  void draw_tumour(cv::Mat& image, const RigidTransform& T, const Stroke& stroke) const {
    const RigidTransform T_reference_ras = T.inverse();
    if (done_.tumour == nullptr) {
      const cv::Point2d at = plane_.pixel(T_reference_ras * done_.target);
      draw_polyline(image, {at - cv::Point2d(14, 0), at + cv::Point2d(14, 0)}, stroke);
      draw_polyline(image, {at - cv::Point2d(0, 14), at + cv::Point2d(0, 14)}, stroke);
      return;
    }
    const Vec3 normal = T.linear() * plane_.normal;
    const double offset = normal.dot(T * Vec3(plane_.pose.translation()));
    for (const auto& line : section_polylines(*done_.tumour, normal, offset)) {
      std::vector<cv::Point2d> pixels;
      for (const Vec3& x : line) pixels.push_back(plane_.pixel(T_reference_ras * x));
      draw_polyline(image, pixels, stroke);
    }
  }

  const RegisteredUltrasound& done_;
  FramePlane plane_;
  cv::Mat_<float> echo_;
  double middle_ = 0.0, bright_ = 1.0;
  std::string name_;
};

cv::Mat stacked(const std::vector<cv::Mat>& rows) {
  int height = -kRowGap, width = 0;
  for (const cv::Mat& row : rows) height += row.rows + kRowGap, width = std::max(width, row.cols);
  cv::Mat all(height, width, CV_8UC3, palette::kWhite);
  int top = 0;
  for (const cv::Mat& row : rows) {
    row.copyTo(all(cv::Rect(cv::Point(0, top), row.size())));
    top += row.rows + kRowGap;
  }
  return all;
}

// Frames as boxes from the image to RAS, each link as an arrow in its own direction.
cv::Mat chain_strip(const std::vector<std::string>& links, int width) {
  cv::Mat strip(170, width, CV_8UC3, palette::kWhite);
  std::vector<tracking::FramePair> pairs;
  for (const std::string& link : links)
    if (const auto pair = tracking::parse_transform_name(link)) pairs.push_back(*pair);
  if (pairs.empty()) return strip;
  // The first link's frame that the second does not share.
  const bool turned =
      pairs.size() > 1 && (pairs[0].from == pairs[1].from || pairs[0].from == pairs[1].to);
  std::string here = turned ? pairs[0].to : pairs[0].from;
  const TextStyle name{.cap_px = 20.0, .align = Align::kCentre, .bold = true};
  const TextStyle small{.cap_px = 15.0, .colour = palette::kGrey, .align = Align::kCentre};
  const double step = (width - 80.0) / static_cast<double>(pairs.size() + 1);
  const auto centre = [&](std::size_t i) {
    return cv::Point(static_cast<int>(40.0 + step * (static_cast<double>(i) + 0.5)), 80);
  };
  const auto half = [&](const std::string& text) { return text_width(text, name) / 2 + 18; };
  for (std::size_t i = 0; i <= pairs.size(); ++i) {
    const int reach = half(here);
    cv::rectangle(strip, cv::Rect(centre(i).x - reach, 52, 2 * reach, 56), palette::kInk, 2);
    draw_text(strip, {centre(i).x, 90}, here, name);
    if (i == pairs.size()) break;
    const bool along = pairs[i].from == here;
    const std::string next = along ? pairs[i].to : pairs[i].from;
    const cv::Point2d left(centre(i).x + reach + 8, 80),
        right(centre(i + 1).x - half(next) - 8, 80);
    const bool found = i + 1 == pairs.size();
    const Stroke stroke{found ? palette::kOrange : palette::kInk, 3, 0.0};
    draw_arrow(strip, along ? left : right, along ? right : left, stroke);
    const cv::Point label(static_cast<int>(0.5 * (left.x + right.x)), 136);
    draw_text(strip, label, pairs[i].name() + (found ? ", found" : ""), small);
    here = next;
  }
  return strip;
}

}  // namespace

CrossingFrames crossing_frames(const tracking::Recording& recording,
                               const ultrasound::ImagePoses& poses, const Vec3& target_reference) {
  const auto nearest = [&](const std::optional<Vec3>& across) -> std::optional<int> {
    double least = std::numeric_limits<double>::infinity();
    std::optional<int> best;
    for (int frame = 0; frame < recording.num_frames(); ++frame) {
      const auto& pose = poses[static_cast<std::size_t>(frame)];
      if (!pose) continue;
      const FramePlane plane = plane_of(recording, *pose);
      if (across && std::abs(plane.normal.dot(*across)) > kCrossing) continue;
      const double distance = distance_mm(plane, target_reference);
      if (distance < least) least = distance, best = frame;
    }
    return best;
  };
  CrossingFrames frames;
  frames.first = nearest(std::nullopt).value_or(0);
  frames.second =
      nearest(plane_of(recording, *poses[static_cast<std::size_t>(frames.first)]).normal);
  return frames;
}

Result<std::string> registration_png(const std::string& name, const RegisteredUltrasound& done) {
  const CrossingFrames frames =
      crossing_frames(done.recording, done.poses, done.T_after.inverse() * done.target);
  std::vector<FrameRow> rows;
  rows.emplace_back(done, frames.first);
  if (frames.second) rows.emplace_back(done, *frames.second);
  const geometry::Interpolator mri(done.mri);
  std::vector<double> seen;
  for (const FrameRow& row : rows) row.add_values(mri, seen);
  const double white = seen.empty() ? 1.0 : std::max(percentile(seen, 99.5), 1e-6);
  std::vector<cv::Mat> ultrasound, before, after;
  for (const FrameRow& row : rows) {
    ultrasound.push_back(row.ultrasound());
    before.push_back(row.on_mri(mri, white, done.T_before));
    after.push_back(row.on_mri(mri, white, done.T_after));
  }
  Sheet sheet;
  sheet.title = done.title;
  sheet.subtitle = done.subtitle;
  sheet.panels = {{"ultrasound", stacked(ultrasound)},
                  {"on the MRI, before", stacked(before)},
                  {"on the MRI, after", stacked(after)}};
  const std::string what = done.tumour != nullptr ? "tumour of the MRI" : "target";
  sheet.legend = {{what + ", before", kTumourThen},
                  {what, kTumourNow},
                  {"echoes on the MRI", {kEchoes, 10, 0.0}}};
  cv::Mat image = compose(sheet);
  cv::vconcat(image, chain_strip(done.links, image.cols), image);
  return encode_png(name, image);
}

}  // namespace brainshift::client
