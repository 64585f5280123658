// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/distance_volume.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace brainshift::geometry {
namespace {

// Closer to the continued surface than this (mm), the direction away from it is rounding.
constexpr double kTouching = 1e-9;

}  // namespace

DistanceVolume::DistanceVolume(DistanceGrid grid)
    : grid_(std::move(grid)),
      last_cell_(grid_.dims[0] - 1, grid_.dims[1] - 1, grid_.dims[2] - 1),
      per_mm_(1.0 / grid_.spacing_mm) {}

Result<DistanceVolume> DistanceVolume::create(DistanceGrid grid) {
  if (grid.empty()) return fail(ErrorCode::kEmptySet, "distance grid: no values");
  if (Status valid = validate(grid); !valid) return tl::unexpected(valid.error());
  return DistanceVolume(std::move(grid));
}

// cells: position in units of the spacing, from the first node; within the grid.
DistanceSample DistanceVolume::inside(const Vec3& cells) const {
  const auto [n0, n1, n2] = grid_.dims;
  const int i = std::min(static_cast<int>(cells[0]), n0 - 2);
  const int j = std::min(static_cast<int>(cells[1]), n1 - 2);
  const int k = std::min(static_cast<int>(cells[2]), n2 - 2);
  const double u = cells[0] - i, v = cells[1] - j, w = cells[2] - k;
  const float* p = grid_.values.data() + grid_.index(i, j, k);
  const float* q = p + static_cast<std::size_t>(n0) * static_cast<std::size_t>(n1);
  // Along x first: value and difference on the cell's four edges in that direction.
  const double a0 = p[0], b0 = p[n0], c0 = q[0], d0 = q[n0];
  const double a1 = p[1] - a0, b1 = p[n0 + 1] - b0, c1 = q[1] - c0, d1 = q[n0 + 1] - d0;
  const double a = a0 + u * a1, b = b0 + u * b1, c = c0 + u * c1, d = d0 + u * d1;
  const double low = a + v * (b - a), high = c + v * (d - c);
  const double low_x = a1 + v * (b1 - a1), high_x = c1 + v * (d1 - c1);
  DistanceSample sample;
  sample.distance_mm = low + w * (high - low);
  sample.gradient =
      per_mm_ * Vec3(low_x + w * (high_x - low_x), (b - a) + w * ((d - c) - (b - a)), high - low);
  return sample;
}

DistanceSample DistanceVolume::outside(const Vec3& x, const Vec3& cells) const {
  const Vec3 nearest = cells.cwiseMax(0.0).cwiseMin(last_cell_);
  DistanceSample rim = inside(nearest);
  const double slope = rim.gradient.norm();
  if (!(slope > kTouching)) return rim;
  const Vec3 c = grid_.origin_mm + grid_.spacing_mm * nearest;
  const Vec3 away = x - (c - rim.distance_mm * rim.gradient / slope);
  DistanceSample sample;
  const double size = away.norm();
  // Beyond a grid that ends inside the surface the sign is that of the grid's rim.
  const double sign = rim.distance_mm < 0.0 ? -1.0 : 1.0;
  sample.distance_mm = sign * size;
  sample.gradient = size > kTouching ? Vec3(sign * away / size) : Vec3(rim.gradient / slope);
  return sample;
}

DistanceSample DistanceVolume::at(const Vec3& x) const {
  const Vec3 cells = per_mm_ * (x - grid_.origin_mm);
  const bool within = (cells.array() >= 0.0).all() && (cells.array() <= last_cell_.array()).all();
  return within ? inside(cells) : outside(x, cells);
}

void DistanceVolume::at(const PointRows& points, VecX& distances_mm, PointRows& gradients) const {
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const DistanceSample sample = at(Vec3(points.row(i)));
    distances_mm[i] = sample.distance_mm;
    gradients.row(i) = sample.gradient;
  }
}

}  // namespace brainshift::geometry
