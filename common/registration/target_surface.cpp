// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/target_surface.hpp"

namespace brainshift::registration {
namespace {

using geometry::PointRows;

// Closer than this (mm), the direction from the surface to a point is rounding. The triangle's
// normal is not.
constexpr double kTouching = 1e-7;

}  // namespace

TargetSurface::TargetSurface(const geometry::ClosestPointIndex& triangles)
    : measure_([&triangles](const PointRows& points, VecX& distances_mm, PointRows& gradients) {
        for (Eigen::Index i = 0; i < points.rows(); ++i) {
          const Vec3 x = points.row(i);
          const geometry::ClosestPoint closest = triangles.closest(x);
          const Vec3 away = x - closest.point;
          const Vec3 n = closest.distance_mm > kTouching
                             ? Vec3(away / closest.distance_mm)
                             : triangles.triangle_normal(closest.triangle);
          gradients.row(i) = n;
          distances_mm[i] = n.dot(away);
        }
      }) {}

TargetSurface::TargetSurface(const geometry::DistanceVolume& volume)
    : measure_([&volume](const PointRows& points, VecX& distances_mm, PointRows& gradients) {
        volume.at(points, distances_mm, gradients);
      }) {}

}  // namespace brainshift::registration
