// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/ultrasound/lesion_tracer.hpp"

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace brainshift::ultrasound {
namespace {

constexpr float kMissing = std::numeric_limits<float>::quiet_NaN();
constexpr double kImpossible = -1e30;

// Greatest step from ray to ray, in samples: the path may lean 60 degrees against the circle.
int greatest_step(const Eigen::MatrixXf& gain) {
  const double angle = 2.0 * std::numbers::pi / static_cast<double>(gain.rows());
  return std::max(
      1, static_cast<int>(std::ceil(1.7 * angle * static_cast<double>(gain.cols()) / 2.0)));
}

// The best path from ray `start` round to it again. With fixed >= 0 it begins and ends at that
// radius, else at any.
std::vector<int> best_path(const Eigen::MatrixXf& gain, const std::vector<RadiusRange>& range,
                           double stiffness, std::size_t start, int fixed) {
  const std::size_t rays = range.size();
  const auto radii = static_cast<std::size_t>(gain.cols());
  const int step = greatest_step(gain);
  std::vector<double> score(radii, kImpossible), next(radii);
  std::vector<std::vector<int>> from(rays + 1, std::vector<int>(radii, 0));
  for (int r = range[start].first; r <= range[start].last; ++r) {
    if (fixed < 0 || r == fixed) score[static_cast<std::size_t>(r)] = 0.0;
  }
  for (std::size_t k = 1; k <= rays; ++k) {
    const std::size_t ray = (start + k) % rays;
    std::fill(next.begin(), next.end(), kImpossible);
    for (int r = range[ray].first; r <= range[ray].last; ++r) {
      double best = kImpossible;
      int best_from = r;
      for (int p = std::max(0, r - step); p <= std::min(static_cast<int>(radii) - 1, r + step);
           ++p) {
        const double value = score[static_cast<std::size_t>(p)] - stiffness * std::abs(r - p);
        if (value > best) best = value, best_from = p;
      }
      next[static_cast<std::size_t>(r)] = best + gain(static_cast<Eigen::Index>(ray), r);
      from[k][static_cast<std::size_t>(r)] = best_from;
    }
    score.swap(next);
  }
  int at = fixed;
  if (fixed < 0)
    at = static_cast<int>(std::max_element(score.begin(), score.end()) - score.begin());
  std::vector<int> path(rays);
  for (std::size_t k = rays; k >= 1; --k) {
    path[(start + k) % rays] = at;
    at = from[k][static_cast<std::size_t>(at)];
  }
  return path;
}

}  // namespace

Eigen::MatrixXf smoothed_frame(const tracking::Recording& recording, int frame, double sd_px) {
  const int type = recording.pixel_type == tracking::PixelType::kUint8   ? CV_8U
                   : recording.pixel_type == tracking::PixelType::kInt16 ? CV_16S
                                                                         : CV_16U;
  const cv::Mat stored(recording.height, recording.width, type,
                       const_cast<char*>(recording.frame_bytes(frame).data()));
  cv::Mat image;
  stored.convertTo(image, CV_32F);
  if (sd_px > 0.0) cv::GaussianBlur(image, image, cv::Size(0, 0), sd_px);
  Eigen::MatrixXf values(recording.height, recording.width);
  for (int v = 0; v < image.rows; ++v) {
    values.row(v) = Eigen::Map<const Eigen::RowVectorXf>(image.ptr<float>(v), image.cols);
  }
  return values;
}

PolarImage polar_image(const Eigen::MatrixXf& image, const Eigen::Vector2d& centre_px, int rays,
                       int radii) {
  PolarImage polar(rays, radii);
  for (int j = 0; j < rays; ++j) {
    const double angle = 2.0 * std::numbers::pi * j / rays;
    for (int r = 0; r < radii; ++r) {
      const double u = centre_px.x() + r * std::cos(angle);
      const double v = centre_px.y() + r * std::sin(angle);
      const auto u0 = static_cast<Eigen::Index>(std::floor(u));
      const auto v0 = static_cast<Eigen::Index>(std::floor(v));
      if (u0 < 0 || v0 < 0 || u0 + 1 >= image.cols() || v0 + 1 >= image.rows()) {
        polar(j, r) = kMissing;
        continue;
      }
      const auto a = static_cast<float>(u - static_cast<double>(u0));
      const auto b = static_cast<float>(v - static_cast<double>(v0));
      polar(j, r) = (1 - b) * ((1 - a) * image(v0, u0) + a * image(v0, u0 + 1)) +
                    b * ((1 - a) * image(v0 + 1, u0) + a * image(v0 + 1, u0 + 1));
    }
  }
  return polar;
}

Eigen::MatrixXf edge_strength(const PolarImage& polar, int width) {
  Eigen::MatrixXf strength = Eigen::MatrixXf::Zero(polar.rows(), polar.cols());
  for (Eigen::Index r = 1; r + width < polar.cols(); ++r) {
    const Eigen::Index inside = std::min<Eigen::Index>(width, r);
    strength.col(r) = polar.middleCols(r - inside, inside).rowwise().mean() -
                      polar.middleCols(r + 1, width).rowwise().mean();
  }
  return strength.array().isNaN().select(0.0F, strength);
}

std::vector<int> best_closed_path(const Eigen::MatrixXf& gain,
                                  const std::vector<RadiusRange>& range, double stiffness) {
  // Half a turn away from where the open path began, its end effects are forgotten.
  const std::size_t opposite = range.size() / 2;
  const std::vector<int> open = best_path(gain, range, stiffness, 0, -1);
  return best_path(gain, range, stiffness, opposite, open[opposite]);
}

namespace {

// Samples this close to the contour belong to neither side: smoothing mixes them.
constexpr int kBlur = 2;
// Standard deviation of the Gaussian; about a speckle. Speckles much larger than this are fewer
// than the significance counts.
constexpr double kSmoothing_px = 2.0;
constexpr int kRays = 96;
constexpr int kMinRadius_px = 6;  // smaller ones are speckle
constexpr int kMaxRadius_px = 150;
constexpr int kEdgeWidth_px = 6;
constexpr double kStiffness = 0.3;      // of the image's sd, per pixel of radius from ray to ray
constexpr double kRadiusChange = 0.35;  // from image to image, of the radius

struct Search {
  Eigen::Vector2d centre_px;
  std::vector<RadiusRange> range;
  bool bright;
};

// Sum, sum of squares and count.
struct Moments {
  double sum = 0.0, squares = 0.0, count = 0.0;
  void add(float value) {
    if (std::isnan(value)) return;
    sum += value, squares += static_cast<double>(value) * value, count += 1.0;
  }
  double mean() const { return count > 0.0 ? sum / count : 0.0; }
  double variance() const { return count > 1.0 ? squares / count - mean() * mean() : 0.0; }
};

// Where the ring around a lesion ends on a ray: half as far out again.
int ring_end(const PolarImage& polar, int radius) {
  return std::min<int>(static_cast<int>(polar.cols()) - 1,
                       radius + std::max(2 * kBlur + 2, radius / 2));
}

// Adds the samples of one ray that the path encloses, and those of the ring around it.
void add_sides(const PolarImage& polar, Eigen::Index ray, int radius, Moments& inside,
               Moments& ring) {
  for (int r = 0; r < radius - kBlur; ++r) inside.add(polar(ray, r));
  for (int r = radius + kBlur + 1; r <= ring_end(polar, radius); ++r) ring.add(polar(ray, r));
}

// 1 / n_inside + 1 / n_ring, with n the areas in smoothed speckles. 4 pi sd^2 is the correlation
// area of white noise behind a Gaussian; one pixel is added for the speckle's own size.
double inverse_speckles(const PolarImage& polar, const std::vector<int>& path) {
  double inside_px2 = 0.0, ring_px2 = 0.0;
  for (const int radius : path) {
    const double r = radius, end = ring_end(polar, radius);
    inside_px2 += std::numbers::pi * r * r / static_cast<double>(path.size());
    ring_px2 += std::numbers::pi * (end * end - r * r) / static_cast<double>(path.size());
  }
  const double speckle_px2 = 4.0 * std::numbers::pi * (kSmoothing_px * kSmoothing_px + 1.0);
  return speckle_px2 / inside_px2 + speckle_px2 / ring_px2;
}

void judge(const PolarImage& polar, const std::vector<int>& path, TracedContour& traced) {
  Moments inside, ring;
  for (std::size_t j = 0; j < path.size(); ++j) {
    add_sides(polar, static_cast<Eigen::Index>(j), path[j], inside, ring);
  }
  const double sign = traced.bright ? 1.0 : -1.0;
  const double difference = sign * (inside.mean() - ring.mean());
  const double sd = std::sqrt(std::max(1e-12, 0.5 * (inside.variance() + ring.variance())));
  traced.significance = difference / sd / std::sqrt(inverse_speckles(polar, path));
  int agreeing = 0;
  for (std::size_t j = 0; j < path.size(); ++j) {
    Moments own_inside, own_ring;
    add_sides(polar, static_cast<Eigen::Index>(j), path[j], own_inside, own_ring);
    if (own_inside.count < 1.0 || own_ring.count < 1.0) continue;  // at the image's border
    if (sign * (own_inside.mean() - own_ring.mean()) >= 0.5 * difference) ++agreeing;
  }
  traced.confidence = static_cast<double>(agreeing) / static_cast<double>(path.size());
}

// Where the path's radius from `centre` lies on ray j.
Eigen::Vector2d on_ray(const Eigen::Vector2d& centre, std::size_t j, std::size_t rays,
                       double radius) {
  const double angle = 2.0 * std::numbers::pi * static_cast<double>(j) / static_cast<double>(rays);
  return centre + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
}

// Of the polygon's area.
Eigen::Vector2d centroid(const Eigen::Matrix2Xd& polygon) {
  double area = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  const Eigen::Vector2d origin = polygon.col(0);
  for (Eigen::Index i = 0; i < polygon.cols(); ++i) {
    const Eigen::Vector2d a = polygon.col(i) - origin;
    const Eigen::Vector2d b = polygon.col((i + 1) % polygon.cols()) - origin;
    const double cross = a.x() * b.y() - a.y() * b.x();
    area += cross;
    sum += cross * (a + b) / 3.0;
  }
  return area == 0.0 ? origin : Eigen::Vector2d(origin + sum / area);
}

TracedContour search_once(const Eigen::MatrixXf& image, const Search& search) {
  const PolarImage polar =
      polar_image(image, search.centre_px, kRays, kMaxRadius_px + kEdgeWidth_px + 2);
  Eigen::MatrixXf gain = edge_strength(polar, kEdgeWidth_px);
  if (!search.bright) gain = -gain;
  const double mean = image.mean();
  const double sd = std::sqrt((image.array() - static_cast<float>(mean)).square().mean());
  const std::vector<int> path = best_closed_path(gain, search.range, kStiffness * sd);
  TracedContour traced;
  traced.bright = search.bright;
  traced.contour.points_px.resize(2, kRays);
  for (std::size_t j = 0; j < path.size(); ++j) {
    traced.contour.points_px.col(static_cast<Eigen::Index>(j)) =
        on_ray(search.centre_px, j, path.size(), path[j]);
  }
  judge(polar, path, traced);
  return traced;
}

std::vector<RadiusRange> whole_range() {
  return std::vector<RadiusRange>(kRays, {kMinRadius_px, kMaxRadius_px});
}

// Radii that a contour allows around its centroid: those of the former contour along each ray,
// plus and minus the allowed change.
std::vector<RadiusRange> range_around(const Eigen::Matrix2Xd& contour,
                                      const Eigen::Vector2d& centre) {
  std::vector<RadiusRange> range = whole_range();
  const RadiusRange limits = range.front();
  const auto rays = static_cast<double>(range.size());
  for (std::size_t j = 0; j < range.size(); ++j) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(j) / rays;
    double nearest = std::numbers::pi, radius = 0.0;
    for (Eigen::Index i = 0; i < contour.cols(); ++i) {
      const Eigen::Vector2d d = contour.col(i) - centre;
      const double gap =
          std::abs(std::remainder(std::atan2(d.y(), d.x()) - angle, 2.0 * std::numbers::pi));
      if (gap < nearest) nearest = gap, radius = d.norm();
    }
    const double play = std::max(3.0, kRadiusChange * radius);
    range[j].first = std::clamp(static_cast<int>(radius - play), limits.first, limits.last);
    range[j].last =
        std::clamp(static_cast<int>(std::ceil(radius + play)), limits.first, limits.last);
  }
  return range;
}

// Searches, moves to the centroid of what was found and searches again nearby.
TracedContour search_twice(const Eigen::MatrixXf& image, Search search) {
  const TracedContour first = search_once(image, search);
  search.centre_px = centroid(first.contour.points_px);
  search.range = range_around(first.contour.points_px, search.centre_px);
  return search_once(image, search);
}

Status accept(const TracedContour& traced) {
  if (traced.significance >= kMinSignificance && traced.confidence >= kMinConfidence) return {};
  return fail(
      ErrorCode::kEmptySet,
      fmt::format("no boundary found on frame {}: significance {:.2f} (at least {}), confidence "
                  "{:.2f} (at least {})",
                  traced.contour.frame, traced.significance, kMinSignificance, traced.confidence,
                  kMinConfidence));
}

Status check_seed(const tracking::Recording& recording, const Seed& seed) {
  if (seed.frame < 0 || seed.frame >= recording.num_frames()) {
    return invalid(fmt::format("seed on frame {}: the recording has frames 0 to {}", seed.frame,
                               recording.num_frames() - 1));
  }
  const bool inside = seed.at_px.x() >= 0.0 && seed.at_px.x() <= recording.width - 1 &&
                      seed.at_px.y() >= 0.0 && seed.at_px.y() <= recording.height - 1;
  if (!inside) {
    return invalid(fmt::format("seed at {} {} px on frame {}: the image has {} x {} pixels",
                               seed.at_px.x(), seed.at_px.y(), seed.frame, recording.width,
                               recording.height));
  }
  if (!recording.image_ok[static_cast<std::size_t>(seed.frame)]) {
    return invalid(fmt::format("seed on frame {}: its image is invalid", seed.frame));
  }
  return {};
}

// The images from the seed's on in one direction; returns why it ended.
std::string follow(const tracking::Recording& recording, const TracedContour& start, int direction,
                   std::vector<TracedContour>& contours) {
  TracedContour last = start;
  const int end = direction > 0 ? recording.num_frames() : -1;
  for (int frame = start.contour.frame + direction; frame != end; frame += direction) {
    if (!recording.image_ok[static_cast<std::size_t>(frame)]) continue;
    const Eigen::Vector2d centre = centroid(last.contour.points_px);
    const Search search{centre, range_around(last.contour.points_px, centre), start.bright};
    TracedContour traced = search_twice(smoothed_frame(recording, frame, kSmoothing_px), search);
    traced.contour.frame = frame;
    if (Status found = accept(traced); !found) return found.error().message;
    contours.push_back(traced);
    last = std::move(traced);
  }
  return {};
}

}  // namespace

Result<TracedContour> trace_lesion(const tracking::Recording& recording, const Seed& seed) {
  if (Status ok = check_seed(recording, seed); !ok) return tl::unexpected(ok.error());
  const Eigen::MatrixXf image = smoothed_frame(recording, seed.frame, kSmoothing_px);
  std::optional<TracedContour> best;
  for (const bool bright : {true, false}) {
    TracedContour traced = search_twice(image, {seed.at_px, whole_range(), bright});
    traced.contour.frame = seed.frame;
    if (!best || traced.significance > best->significance) best = std::move(traced);
  }
  if (Status ok = accept(*best); !ok) return tl::unexpected(ok.error());
  return *best;
}

Result<LesionSweep> trace_sweep(const tracking::Recording& recording, const Seed& seed) {
  const auto start = trace_lesion(recording, seed);
  if (!start) return tl::unexpected(start.error());
  LesionSweep sweep;
  sweep.stopped_before = follow(recording, *start, -1, sweep.contours);
  std::reverse(sweep.contours.begin(), sweep.contours.end());
  sweep.contours.push_back(*start);
  sweep.stopped_after = follow(recording, *start, 1, sweep.contours);
  return sweep;
}

}  // namespace brainshift::ultrasound
