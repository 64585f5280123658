// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/stereo/reconstruct.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/configuration/stereo_calibration.hpp"
#include "common/stereo/cleaning.hpp"

namespace brainshift::stereo {
namespace {

// A block needs this fraction of valid pixels for a vertex.
constexpr double kMinBlockFill = 0.5;

Status check(const ReconstructOptions& options, const RigidTransform& T_ras_camera) {
  const auto refuse = [](const char* name, double value, const char* must) {
    return invalid(fmt::format("{} = {}: must be {}", name, value, must));
  };
  if (!(options.spacing_mm > 0.0) || !std::isfinite(options.spacing_mm))
    return refuse("spacing_mm", options.spacing_mm, "finite and > 0");
  if (options.max_points < kFewestPoints)
    return refuse("max_points", options.max_points, "at least 50");
  return check_rigid("T_ras_camera", T_ras_camera.matrix());
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Grid {
  int columns = 0, rows = 0;
  std::vector<int> vertex;   // per block, -1: none
  std::vector<Vec3> points;  // left camera frame
  std::vector<double> sd_px, sd_mm;
};

// Mean of a block's pixels near their median; false when too few are valid.
bool block_vertex(const PixelMap<float>& disparity, const PixelMap<float>& sd_px,
                  const RectifiedGeometry& geometry, int left, int top, int step, Grid& grid) {
  std::vector<double> values;
  const int right = std::min(left + step, disparity.width);
  const int bottom = std::min(top + step, disparity.height);
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x)
      if (!std::isnan(disparity.at(x, y)))
        values.push_back(static_cast<double>(disparity.at(x, y)));
  if (static_cast<double>(values.size()) < kMinBlockFill * step * step) return false;
  const double middle = median(values);
  double n = 0.0, x_sum = 0.0, y_sum = 0.0, d_sum = 0.0, variance = 0.0;
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) {
      const auto d = static_cast<double>(disparity.at(x, y));
      if (!(std::abs(d - middle) <= kMaxPartStep_px)) continue;
      const auto sd = static_cast<double>(sd_px.at(x, y));
      n += 1.0;
      x_sum += x;
      y_sum += y;
      d_sum += d;
      variance += sd * sd;
    }
  }
  const double d = d_sum / n, sd = std::sqrt(variance / n);
  if (!(depth_at(geometry, d) > 0.0)) return false;  // beyond infinity
  grid.points.push_back(triangulate(geometry, x_sum / n, y_sum / n, d));
  grid.sd_px.push_back(sd);
  grid.sd_mm.push_back(depth_sd_mm(geometry, d, sd));
  return true;
}

Grid grid_of(const PixelMap<float>& disparity, const PixelMap<float>& sd_px,
             const RectifiedGeometry& geometry, int step) {
  Grid grid;
  grid.columns = (disparity.width + step - 1) / step;
  grid.rows = (disparity.height + step - 1) / step;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const int next = static_cast<int>(grid.points.size());
      const bool made =
          block_vertex(disparity, sd_px, geometry, column * step, row * step, step, grid);
      grid.vertex.push_back(made ? next : -1);
    }
  }
  return grid;
}

void drop_outliers(Grid& grid, ReconstructedSurface& result) {
  const std::vector<bool> outlier = distance_outliers(columns_of(grid.points), kOutlierSds);
  for (int& vertex : grid.vertex) {
    if (vertex < 0 || !outlier[static_cast<std::size_t>(vertex)]) continue;
    vertex = -1;
    ++result.outlier_points;
  }
}

using Triangle = std::array<int, 3>;

// Adds a triangle that is counter-clockwise seen from the camera (picture axes: x right, y down),
// unless its normal is too far from the line of sight.
void add_triangle(const Grid& grid, const Triangle& t, double min_cosine,
                  std::vector<Triangle>& out) {
  const auto point = [&](int k) {
    return grid.points[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])];
  };
  const Vec3 a = point(0), b = point(1), c = point(2);
  const Vec3 normal = (b - a).cross(c - a).normalized();
  if (normal.dot(-(a + b + c).normalized()) >= min_cosine) out.push_back(t);
}

// Two triangles for a cell of four vertices, along its shorter diagonal; one for three.
std::vector<Triangle> triangles_of(const Grid& grid, double min_cosine) {
  std::vector<Triangle> triangles;
  const auto vertex = [&](int column, int row) {
    return grid.vertex[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                       static_cast<std::size_t>(column)];
  };
  const auto length = [&](int i, int j) {
    return (grid.points[static_cast<std::size_t>(i)] - grid.points[static_cast<std::size_t>(j)])
        .norm();
  };
  for (int row = 0; row + 1 < grid.rows; ++row) {
    for (int column = 0; column + 1 < grid.columns; ++column) {
      // Round the cell, counter-clockwise seen from the camera: down, right, up.
      const std::array<int, 4> ring = {vertex(column, row), vertex(column, row + 1),
                                       vertex(column + 1, row + 1), vertex(column + 1, row)};
      const auto missing = std::count(ring.begin(), ring.end(), -1);
      if (missing > 1) continue;
      if (missing == 1) {
        Triangle t{};
        std::copy_if(ring.begin(), ring.end(), t.begin(), [](int v) { return v >= 0; });
        add_triangle(grid, t, min_cosine, triangles);
      } else if (length(ring[0], ring[2]) <= length(ring[1], ring[3])) {
        add_triangle(grid, {ring[0], ring[1], ring[2]}, min_cosine, triangles);
        add_triangle(grid, {ring[0], ring[2], ring[3]}, min_cosine, triangles);
      } else {
        add_triangle(grid, {ring[0], ring[1], ring[3]}, min_cosine, triangles);
        add_triangle(grid, {ring[1], ring[2], ring[3]}, min_cosine, triangles);
      }
    }
  }
  return triangles;
}

// Vertices that have a triangle, in their order.
void store(const Grid& grid, const std::vector<Triangle>& triangles,
           const RigidTransform& T_ras_camera, ReconstructedSurface& result) {
  std::vector<int> new_index(grid.points.size(), -1);
  for (const Triangle& t : triangles)
    for (const int v : t) new_index[static_cast<std::size_t>(v)] = 0;
  int next = 0;
  for (int& index : new_index)
    if (index == 0) index = next++;
  TriangleSurface& surface = result.surface;
  surface.vertices.resize(3, next);
  result.sd_mm.resize(next);
  result.confidence.resize(next);
  for (std::size_t i = 0; i < new_index.size(); ++i) {
    if (new_index[i] < 0) continue;
    surface.vertices.col(new_index[i]) = T_ras_camera * grid.points[i];
    result.sd_mm[new_index[i]] = grid.sd_mm[i];
    result.confidence[new_index[i]] = confidence(grid.sd_px[i]);
  }
  surface.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      surface.triangles(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(t)) =
          new_index[static_cast<std::size_t>(triangles[t][k])];
}

int block_step(double median_depth_mm, double pixels, const RectifiedGeometry& geometry,
               const ReconstructOptions& options) {
  const double by_spacing = options.spacing_mm * geometry.focal_px / median_depth_mm;
  const double by_count = std::sqrt(pixels / options.max_points);
  return std::max(1, static_cast<int>(std::ceil(std::max(std::floor(by_spacing), by_count))));
}

}  // namespace

Result<ReconstructedSurface> reconstruct(const DisparityMap& map, const RectifiedGeometry& geometry,
                                         const RigidTransform& T_ras_camera,
                                         const ReconstructOptions& options) {
  if (Status ok = check(options, T_ras_camera); !ok) return tl::unexpected(ok.error());
  ReconstructedSurface result;
  PixelMap<float> kept = map.disparity_px;
  result.pixels_in_small_parts = drop_minor_parts(kept, kMaxPartStep_px, kMinPart).dropped;
  std::vector<double> depths;
  for (const float d : kept.pixels)
    if (!std::isnan(d)) depths.push_back(depth_at(geometry, static_cast<double>(d)));
  const auto too_few = [&](int count) {
    return fail(ErrorCode::kEmptySet, fmt::format("the surface has {} points: must be at least {}",
                                                  count, kFewestPoints));
  };
  if (depths.empty()) return too_few(0);
  result.median_depth_mm = median(depths);
  if (!(result.median_depth_mm > 0.0)) return too_few(0);
  const int step =
      block_step(result.median_depth_mm, static_cast<double>(depths.size()), geometry, options);
  Grid grid = grid_of(kept, map.sd_px, geometry, step);
  drop_outliers(grid, result);
  const double min_cosine = std::cos(kMaxViewAngle_deg * std::numbers::pi / 180.0);
  store(grid, triangles_of(grid, min_cosine), T_ras_camera, result);
  if (result.surface.num_vertices() < kFewestPoints) return too_few(result.surface.num_vertices());
  result.median_sd_mm = median({result.sd_mm.begin(), result.sd_mm.end()});
  return result;
}

}  // namespace brainshift::stereo
