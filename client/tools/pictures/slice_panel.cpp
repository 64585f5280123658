// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/slice_panel.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "common/core/statistics.hpp"
#include "common/geometry/mask.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::client {

cv::Size SliceWindow::size() const {
  return {static_cast<int>(std::lround((across_max - across_min) * px_per_mm)),
          static_cast<int>(std::lround((up_max - up_min) * px_per_mm))};
}

cv::Point2d SliceWindow::pixel(const Vec3& x_ras) const {
  return {(across_max - x_ras(across_axis())) * px_per_mm, (up_max - x_ras(up_axis())) * px_per_mm};
}

Vec3 SliceWindow::position(cv::Point2d pixel) const {
  Vec3 x_ras = Vec3::Constant(offset_mm);
  x_ras(across_axis()) = across_max - pixel.x / px_per_mm;
  x_ras(up_axis()) = up_max - pixel.y / px_per_mm;
  return x_ras;
}

SliceWindow whole_head(const Points& nodes, const Vec3& through, Plane plane) {
  constexpr double kMargin_mm = 10.0;
  constexpr double kPx_per_mm = 5.0;
  const Vec3 low = nodes.rowwise().minCoeff().array() - kMargin_mm;
  const Vec3 high = nodes.rowwise().maxCoeff().array() + kMargin_mm;
  SliceWindow window{plane, 0.0, low.x(), high.x(), 0.0, 0.0, kPx_per_mm};
  window.offset_mm = through(window.normal_axis());
  window.up_min = low(window.up_axis());
  window.up_max = high(window.up_axis());
  return window;
}

SliceWindow close_up(const Vec3& centre, double half_mm, double px_per_mm, Plane plane) {
  SliceWindow window{plane, 0.0, centre.x() - half_mm, centre.x() + half_mm, 0.0, 0.0, px_per_mm};
  window.offset_mm = centre(window.normal_axis());
  window.up_min = centre(window.up_axis()) - half_mm;
  window.up_max = centre(window.up_axis()) + half_mm;
  return window;
}

SliceSamples sample_slice(const geometry::TetLocator& locator, const SliceWindow& window,
                          double spacing_mm) {
  constexpr double kInside_mm = 1e-6;
  SliceSamples samples;
  samples.spacing_mm = spacing_mm;
  // Multiples of the spacing, so that panels of different windows sample the same places.
  const auto first = [spacing_mm](double min) { return std::ceil(min / spacing_mm) * spacing_mm; };
  for (double up = first(window.up_min); up <= window.up_max; up += spacing_mm) {
    for (double x = first(window.across_min); x <= window.across_max; x += spacing_mm) {
      Vec3 position = Vec3::Constant(window.offset_mm);
      position(window.across_axis()) = x;
      position(window.up_axis()) = up;
      const geometry::TetLocation location = locator.locate(position);
      if (location.tet < 0 || location.distance_mm > kInside_mm) continue;
      samples.positions.push_back(position);
      samples.locations.push_back(location);
    }
  }
  return samples;
}

TriangleSurface deformed_surface(const TriangleSurface& surface,
                                 const geometry::TetLocator& locator, const Points& displacement) {
  TriangleSurface moved = surface;
  for (Eigen::Index v = 0; v < surface.vertices.cols(); ++v) {
    moved.vertices.col(v) +=
        geometry::value_at(locator.locate(surface.vertices.col(v)), displacement);
  }
  return moved;
}

std::vector<std::vector<Vec3>> section_polylines(const TriangleSurface& surface, const Vec3& normal,
                                                 double offset) {
  constexpr double kSame_mm = 1e-6;
  const Points ends = geometry::plane_section(surface, normal, offset);
  const auto end = [&ends](std::size_t segment, int which) -> Vec3 {
    return ends.col(static_cast<Eigen::Index>(2 * segment) + which);
  };
  const auto same = [](const Vec3& a, const Vec3& b) { return (a - b).norm() < kSame_mm; };
  // The two sides of a sheet lie on each other: one is enough, and a line would turn back on the
  // other.
  std::vector<bool> used(static_cast<std::size_t>(ends.cols()) / 2, false);
  for (std::size_t s = 0; s < used.size(); ++s) {
    for (std::size_t other = 0; other < s && !used[s]; ++other) {
      if (used[other]) continue;
      used[s] = (same(end(s, 0), end(other, 0)) && same(end(s, 1), end(other, 1))) ||
                (same(end(s, 0), end(other, 1)) && same(end(s, 1), end(other, 0)));
    }
  }
  std::vector<std::vector<Vec3>> lines;
  // The unused segment that starts or ends at `from`; its far end is appended.
  const auto extend = [&](std::vector<Vec3>& line) {
    for (std::size_t s = 0; s < used.size(); ++s) {
      if (used[s]) continue;
      const bool at_first = same(end(s, 0), line.back());
      if (!at_first && !same(end(s, 1), line.back())) continue;
      used[s] = true;
      line.push_back(end(s, at_first ? 1 : 0));
      return true;
    }
    return false;
  };
  for (std::size_t s = 0; s < used.size(); ++s) {
    if (used[s]) continue;
    used[s] = true;
    std::vector<Vec3> line = {end(s, 0), end(s, 1)};
    while (extend(line)) {
    }
    std::reverse(line.begin(), line.end());
    while (extend(line)) {
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

SlicePanel::SlicePanel(const SliceWindow& window)
    : window_(window), image_(window.size(), CV_8UC3, palette::kBlack) {}

void SlicePanel::draw_mri(const VoxelImage& mri, double brightness, const Origin& origin) {
  const geometry::Interpolator at(mri);
  cv::Mat_<float> grey(image_.size());
  std::vector<double> seen;
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const Vec3 place = window_.position({x + 0.5, y + 0.5});
      const std::optional<Vec3> shown = origin ? origin(place) : place;
      const float value = shown ? at(*shown) : 0.0f;
      grey(y, x) = value;
      if (x % 4 != 0 || y % 4 != 0) continue;
      const float still = origin ? at(place) : value;
      if (still > 0.0f) seen.push_back(still);
    }
  }
  if (seen.empty()) return;
  const double low = percentile(seen, 1.0);
  const double high = std::max(percentile(seen, 99.5), low + 1e-6);
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const double t = std::clamp((grey(y, x) - low) / (high - low), 0.0, 1.0);
      const auto level = static_cast<std::uint8_t>(std::lround(255.0 * brightness * t));
      image_.at<cv::Vec3b>(y, x) = {level, level, level};
    }
  }
}

void SlicePanel::draw_magnitude_map(const SliceSamples& samples, const Points& field, double max_mm,
                                    double opacity) {
  const int half = static_cast<int>(std::ceil(0.5 * samples.spacing_mm * window_.px_per_mm));
  cv::Mat colours = image_.clone();
  for (std::size_t i = 0; i < samples.positions.size(); ++i) {
    const double value = geometry::value_at(samples.locations[i], field).norm();
    const cv::Point2d p = window_.pixel(samples.positions[i]);
    cv::rectangle(
        colours,
        cv::Rect(static_cast<int>(p.x) - half, static_cast<int>(p.y) - half, 2 * half, 2 * half),
        magnitude_colour(max_mm > 0.0 ? value / max_mm : 0.0), cv::FILLED);
  }
  cv::addWeighted(colours, opacity, image_, 1.0 - opacity, 0.0, image_);
}

void SlicePanel::draw_arrows(const SliceSamples& samples, const Points& displacement,
                             double magnification, double max_mm, bool thin) {
  for (std::size_t i = 0; i < samples.positions.size(); ++i) {
    const Vec3 u = geometry::value_at(samples.locations[i], displacement);
    const cv::Point2d from = window_.pixel(samples.positions[i]);
    const cv::Point2d to = window_.pixel(samples.positions[i] + magnification * u);
    const cv::Scalar colour =
        thin ? palette::kWhite : magnitude_colour(max_mm > 0.0 ? u.norm() / max_mm : 0.0);
    if (!thin && cv::norm(to - from) < 3.0) draw_marker(image_, from, Marker::kCircle, colour, 2);
    draw_arrow(image_, from, to, {colour, thin ? 1 : 3, 0.0}, thin ? 10.0 : 14.0, thin ? 0 : 1);
  }
}

bool SlicePanel::draw_section(const TriangleSurface& surface, const Stroke& stroke) {
  const cv::Rect2d picture(0.0, 0.0, image_.cols, image_.rows);
  bool seen = false;
  std::vector<std::vector<cv::Point2d>> lines;
  for (const auto& line :
       section_polylines(surface, Vec3::Unit(window_.normal_axis()), window_.offset_mm)) {
    std::vector<cv::Point2d>& pixels = lines.emplace_back();
    for (const Vec3& point : line) {
      pixels.push_back(window_.pixel(point));
      seen = seen || picture.contains(pixels.back());
    }
  }
  // Rims below all lines, so that none parts two that meet.
  const Stroke rim{palette::kBlack, stroke.thickness + 2 * stroke.rim, 0.0};
  const Stroke inner{stroke.colour, stroke.thickness, stroke.dash_px};
  for (const auto& line : lines) {
    if (stroke.rim > 0) draw_polyline(image_, line, rim);
  }
  for (const auto& line : lines) draw_polyline(image_, line, inner);
  return seen;
}

bool SlicePanel::draw_voxels(const VoxelImage& mask, const Stroke& stroke) {
  const AffineTransform T_voxel_ras = mask.T_ras_voxel.inverse();
  cv::Mat inside(image_.size(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < inside.rows; ++y) {
    for (int x = 0; x < inside.cols; ++x) {
      const Vec3 place = window_.position({x + 0.5, y + 0.5});
      if (geometry::mask_has(mask, T_voxel_ras, place)) inside.at<std::uint8_t>(y, x) = 1;
    }
  }
  std::vector<std::vector<cv::Point>> edges;
  cv::findContours(inside, edges, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
  for (const auto& edge : edges) {
    std::vector<cv::Point2d> line(edge.begin(), edge.end());
    line.push_back(line.front());
    draw_polyline(image_, line, stroke);
  }
  return !edges.empty();
}

void SlicePanel::draw_orientation(double bar_mm) {
  const bool axial = window_.plane == Plane::kAxial;
  const bool sagittal = window_.plane == Plane::kSagittal;
  const TextStyle letter = on_picture(26.0, true);
  const int w = image_.cols;
  const int h = image_.rows;
  draw_text(image_, {24, h / 2 + 13}, sagittal ? "A" : "R", letter);
  draw_text(image_, {w - 24, h / 2 + 13}, sagittal ? "P" : "L", letter);
  draw_text(image_, {w / 2, 40}, axial ? "A" : "S", letter);
  draw_text(image_, {w / 2, h - 14}, axial ? "P" : "I", letter);
  const double length = bar_mm * window_.px_per_mm;
  const cv::Point2d start(24.0, h - 30.0);
  draw_polyline(image_, {start, start + cv::Point2d(length, 0)}, {palette::kBlack, 10, 0.0});
  draw_polyline(image_, {start, start + cv::Point2d(length, 0)}, {palette::kWhite, 5, 0.0});
  draw_text(image_, {static_cast<int>(start.x + length / 2), h - 44},
            fixed_decimals(bar_mm, 0) + " mm", on_picture(20.0));
}

void SlicePanel::draw_gravity(const Vec3& direction) {
  // Both axes of a slice run against those of its pixels.
  draw_gravity_arrow(image_, {-direction(window_.across_axis()), -direction(window_.up_axis())});
}

}  // namespace brainshift::client
