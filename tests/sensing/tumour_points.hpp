// SPDX-License-Identifier: GPL-3.0-or-later
// A tumour whose rotation shows, and points on it as ultrasound would give them.
#pragma once

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "common/core/random.hpp"
#include "common/core/types.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/distance_volume.hpp"
#include "common/geometry/surface.hpp"
#include "common/registration/pose_information.hpp"

namespace brainshift::sensing {

inline const Vec3 kTumourCentre(46.0, -47.0, 9.0);

// 5,120 triangles: semi-axes 18, 14 and 10.5 mm and a bump of 4 mm beside the axes.
inline TriangleSurface tumour_surface() {
  TriangleSurface surface = geometry::ellipsoid_surface(Vec3::Zero(), Vec3(18, 14, 10.5), 1.05);
  const Vec3 place = Vec3(0.6, 0.6, 0.53).normalized();
  for (auto x : surface.vertices.colwise()) {
    const double off = (x.normalized() - place).squaredNorm();
    x += 4.0 * std::exp(-off / 0.2) * x.normalized();
  }
  surface.vertices.colwise() += kTumourCentre;
  return surface;
}

// What aligning needs of a surface, in both forms.
struct IndexedSurface {
  TriangleSurface surface;
  geometry::ClosestPointIndex index;
  geometry::DistanceVolume volume;
};

inline IndexedSurface indexed(TriangleSurface surface) {
  auto index = geometry::ClosestPointIndex::build(surface).value();
  auto grid = geometry::signed_distance_grid(index).value();
  auto volume = geometry::DistanceVolume::create(std::move(grid)).value();
  return {std::move(surface), std::move(index), std::move(volume)};
}

// `count` points of eight planar sections through the surface, two fans of four. Most of the
// surface is not seen.
inline Points section_points(const TriangleSurface& surface, int count, Random& random) {
  std::vector<Vec3> ends;
  const Vec3 sweep[] = {random.direction(), random.direction()};
  for (const Vec3& normal : sweep)
    for (const double offset : {-6.0, -2.0, 2.0, 6.0}) {
      const Points section =
          geometry::plane_section(surface, normal, normal.dot(kTumourCentre) + offset);
      for (const Vec3 end : section.colwise()) ends.push_back(end);
    }
  Points points(3, count);
  for (auto x : points.colwise()) x = ends[random.index(ends.size())];
  return points;
}

inline RigidTransform random_motion(double translation_mm, double rotation_deg, Random& random) {
  registration::Vec6 xi;
  xi << rotation_deg * std::numbers::pi / 180.0 * random.direction(),
      translation_mm * random.direction();
  return registration::rigid_increment(xi, kTumourCentre);
}

// Points as measured: moved, with Gaussian noise in each coordinate; with `outliers`, every tenth
// point is 5 to 30 mm off.
inline Points measured(const Points& on_surface, const RigidTransform& T_points_surface,
                       double noise_mm, bool outliers, Random& random) {
  Points points =
      (T_points_surface.linear() * on_surface).colwise() + Vec3(T_points_surface.translation());
  for (double& value : points.reshaped()) value += noise_mm * random.normal();
  if (outliers)
    for (Eigen::Index i = 0; i < points.cols(); i += 10)
      points.col(i) += (5.0 + 25.0 * random.uniform()) * random.direction();
  return points;
}

// Largest distance between where two poses put the surface's vertices.
inline double largest_error_mm(const RigidTransform& a, const RigidTransform& b,
                               const Points& vertices) {
  const Mat3 linear = a.linear() - b.linear();
  const Vec3 shift = a.translation() - b.translation();
  return ((linear * vertices).colwise() + shift).colwise().norm().maxCoeff();
}

}  // namespace brainshift::sensing
