// SPDX-License-Identifier: GPL-3.0-or-later
// A surface as ICP sees it: triangles and a distance volume of one sphere measure alike.
#include "common/registration/target_surface.hpp"

#include <gtest/gtest.h>

#include "common/core/random.hpp"
#include "common/geometry/distance_volume.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::registration {
namespace {

using geometry::PointRows;

const Vec3 kCentre(5, -3, 8);
const TriangleSurface& sphere() {
  static const TriangleSurface surface =
      geometry::ellipsoid_surface(kCentre, Vec3(12, 12, 12), 0.6);
  return surface;
}
constexpr double kTargetRadius_mm = 12.0;
// Facets with edges of 0.6 mm lie 0.6^2 / (8 R) = 0.004 mm inside the sphere; the volume
// adds hundredths of a millimetre.
constexpr double kTolerance_mm = 0.05;

PointRows points_around() {
  Random random(3);
  PointRows points(200, 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const double radius = kTargetRadius_mm + 4.0 * random.uniform() - 2.0;
    points.row(i) = kCentre + radius * random.direction();
  }
  return points;
}

struct Measured {
  VecX distances_mm;
  PointRows gradients;
};

Measured measure(const TargetSurface& surface, const PointRows& points) {
  Measured measured{VecX(points.rows()), PointRows(points.rows(), 3)};
  surface.measure(points, measured.distances_mm, measured.gradients);
  return measured;
}

// The size of the distance is that from the sphere; the gradient is radial. Triangles give no sign
// to the distance, so both may be turned round together.
void expect_sphere(const TargetSurface& surface) {
  const PointRows points = points_around();
  const Measured measured = measure(surface, points);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Vec3 arm = points.row(i).transpose() - kCentre;
    const double outside_mm = arm.norm() - kTargetRadius_mm;
    EXPECT_NEAR(std::abs(measured.distances_mm[i]), std::abs(outside_mm), kTolerance_mm);
    if (std::abs(outside_mm) < 2.0 * kTolerance_mm) continue;  // the sign is rounding there
    const Vec3 away = measured.distances_mm[i] * Vec3(measured.gradients.row(i));
    EXPECT_LT((away - outside_mm * arm.normalized()).norm(), 2.0 * kTolerance_mm);
  }
}

TEST(TargetSurface, TrianglesMeasureTheDistance) {
  expect_sphere(geometry::ClosestPointIndex::build(sphere()).value());
}

TEST(TargetSurface, AVolumeMeasuresTheDistance) {
  const auto index = geometry::ClosestPointIndex::build(sphere()).value();
  expect_sphere(
      geometry::DistanceVolume::create(geometry::signed_distance_grid(index).value()).value());
}

// On the surface the direction to the closest point is rounding, and the triangle's normal
// decides.
TEST(TargetSurface, AVertexOfTheTrianglesHasAUnitGradient) {
  const auto index = geometry::ClosestPointIndex::build(sphere()).value();
  const PointRows vertices = sphere().vertices.leftCols(20).transpose();
  const Measured measured = measure(index, vertices);
  EXPECT_LT(measured.distances_mm.cwiseAbs().maxCoeff(), 1e-9);
  for (Eigen::Index i = 0; i < vertices.rows(); ++i) {
    const Vec3 outwards = (vertices.row(i).transpose() - kCentre).normalized();
    // Normals of neighbouring facets differ by about the edge over the radius, 0.05.
    EXPECT_GT(measured.gradients.row(i).dot(outwards), 0.99);
  }
}

}  // namespace
}  // namespace brainshift::registration
