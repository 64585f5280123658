// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/pictures/surface_view.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

namespace brainshift::client {
namespace {

constexpr float kNothing = -std::numeric_limits<float>::infinity();
constexpr double kAmbient = 0.35;  // brightness of a face seen edge on
constexpr double kNearlyAlong = 0.9;

// Calls `visit` with every pixel whose centre lies in the triangle, and the depth there.
void visit_pixels(const std::array<cv::Point2d, 3>& corner, const std::array<double, 3>& depth,
                  cv::Size size, const std::function<void(int, int, float)>& visit) {
  const auto [left, right] = std::minmax({corner[0].x, corner[1].x, corner[2].x});
  const auto [top, bottom] = std::minmax({corner[0].y, corner[1].y, corner[2].y});
  const cv::Point2d a = corner[1] - corner[0];
  const cv::Point2d b = corner[2] - corner[0];
  const double twice_area = a.cross(b);
  if (std::abs(twice_area) < 1e-12) return;  // seen edge on
  for (int y = std::max(0, static_cast<int>(std::floor(top)));
       y <= std::min(size.height - 1, static_cast<int>(std::ceil(bottom))); ++y) {
    for (int x = std::max(0, static_cast<int>(std::floor(left)));
         x <= std::min(size.width - 1, static_cast<int>(std::ceil(right))); ++x) {
      const cv::Point2d p = cv::Point2d(x + 0.5, y + 0.5) - corner[0];
      const double s = p.cross(b) / twice_area;
      const double t = a.cross(p) / twice_area;
      if (s < 0.0 || t < 0.0 || s + t > 1.0) continue;
      visit(x, y, static_cast<float>((1.0 - s - t) * depth[0] + s * depth[1] + t * depth[2]));
    }
  }
}

cv::Vec3b shaded(const cv::Scalar& colour, double brightness) {
  cv::Vec3b result;
  for (int c = 0; c < 3; ++c) result[c] = cv::saturate_cast<std::uint8_t>(brightness * colour[c]);
  return result;
}

}  // namespace

ViewPoint view_from(const Vec3& towards, const Vec3& centre) {
  ViewPoint point;
  point.towards = towards;
  point.centre = centre;
  const bool from_above = std::abs(towards.normalized().z()) > kNearlyAlong;
  point.up = from_above ? Vec3(Vec3::UnitY()) : Vec3(Vec3::UnitZ());
  return point;
}

SurfaceView::SurfaceView(const ViewPoint& point)
    : point_(point),
      right_(point.up.cross(point.towards).normalized()),
      towards_(point.towards.normalized()) {
  up_ = towards_.cross(right_);
  const int side = static_cast<int>(std::lround(2.0 * point.half_width_mm * point.px_per_mm));
  image_ = cv::Mat(side, side, CV_8UC3, palette::kBlack);
  nearest_ = cv::Mat_<float>(side, side, kNothing);
}

cv::Point2d SurfaceView::direction_pixels(const Vec3& direction) const {
  return {direction.dot(right_), -direction.dot(up_)};
}

cv::Point2d SurfaceView::pixel(const Vec3& x_ras) const {
  const cv::Point2d middle(0.5 * image_.cols, 0.5 * image_.rows);
  return middle + point_.px_per_mm * direction_pixels(x_ras - point_.centre);
}

double SurfaceView::depth(const Vec3& x_ras) const { return (x_ras - point_.centre).dot(towards_); }

void SurfaceView::draw_surface(const TriangleSurface& surface,
                               const std::vector<cv::Scalar>& colours) {
  for (int t = 0; t < surface.num_triangles(); ++t) {
    std::array<Vec3, 3> x;
    std::array<cv::Point2d, 3> corner;
    std::array<double, 3> depths{};
    for (std::size_t k = 0; k < 3; ++k) {
      x[k] = surface.vertices.col(surface.triangles(static_cast<Eigen::Index>(k), t));
      corner[k] = pixel(x[k]);
      depths[k] = depth(x[k]);
    }
    const Vec3 normal = (x[1] - x[0]).cross(x[2] - x[0]);
    if (!(normal.norm() > 0.0)) continue;
    const double cosine = std::abs(normal.normalized().dot(towards_));
    const cv::Vec3b colour =
        shaded(colours[static_cast<std::size_t>(t)], kAmbient + (1.0 - kAmbient) * cosine);
    visit_pixels(corner, depths, image_.size(), [&](int px, int py, float d) {
      if (d <= nearest_(py, px)) return;
      nearest_(py, px) = d;
      image_.at<cv::Vec3b>(py, px) = colour;
    });
  }
}

void SurfaceView::draw_through(const TriangleSurface& surface, const cv::Scalar& colour,
                               double opacity) {
  SurfaceView alone(point_);
  alone.draw_surface(
      surface, std::vector<cv::Scalar>(static_cast<std::size_t>(surface.num_triangles()), colour));
  cv::Mat mixed;
  cv::addWeighted(alone.image_, opacity, image_, 1.0 - opacity, 0.0, mixed);
  mixed.copyTo(image_, alone.nearest_ > kNothing);
}

bool SurfaceView::shows(const Vec3& x_ras, double tolerance_mm) const {
  const cv::Point at = pixel(x_ras);
  const bool inside = at.x >= 0 && at.y >= 0 && at.x < image_.cols && at.y < image_.rows;
  return inside && depth(x_ras) >= nearest_(at) - tolerance_mm;
}

bool SurfaceView::draw_on_surface(const std::vector<Vec3>& line, const Stroke& stroke,
                                  double tolerance_mm) {
  bool drawn = false;
  std::vector<cv::Point2d> part;
  const auto end_part = [&] {
    drawn = drawn || part.size() > 1;
    draw_polyline(image_, part, stroke);
    part.clear();
  };
  for (const Vec3& x : line) {
    if (shows(x, tolerance_mm)) {
      part.push_back(pixel(x));
    } else {
      end_part();
    }
  }
  end_part();
  return drawn;
}

void SurfaceView::draw_axes() {
  constexpr double kLength_px = 60.0;
  const cv::Point2d origin(100.0, image_.rows - 100.0);
  const std::array<const char*, 3> letters{"R", "A", "S"};
  for (int axis = 0; axis < 3; ++axis) {
    const cv::Point2d along = direction_pixels(Vec3::Unit(axis));
    if (cv::norm(along) < 0.4) continue;  // nearly along the line of sight
    draw_arrow(image_, origin, origin + kLength_px * along, {palette::kWhite, 4, 0.0}, 14.0, 2);
    const cv::Point2d letter = origin + (kLength_px + 22.0) * along;
    draw_text(image_, {static_cast<int>(letter.x), static_cast<int>(letter.y) + 12},
              letters[static_cast<std::size_t>(axis)], on_picture(24.0, true));
  }
}

void SurfaceView::draw_gravity(const Vec3& direction) {
  draw_gravity_arrow(image_, direction_pixels(direction));
}

}  // namespace brainshift::client
