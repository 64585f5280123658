// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/distance_volume.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "common/core/random.hpp"
#include "common/geometry/surface.hpp"
#include "tests/support/results.hpp"

namespace brainshift::geometry {
namespace {

const Vec3 kCentre(35, -45, 20);

ClosestPointIndex voxel_index_of(const TriangleSurface& surface) {
  return value_or_fail(ClosestPointIndex::build(surface));
}

// Not convex: two thirds of a waist around the middle.
TriangleSurface peanut(double edge_mm) {
  TriangleSurface surface = ellipsoid_surface(Vec3::Zero(), Vec3(10, 10, 18), edge_mm);
  for (auto x : surface.vertices.colwise())
    x.head<2>() *= 1.0 - 0.6 * std::exp(-x.z() * x.z() / 18.0);
  surface.vertices.colwise() += kCentre;
  return surface;
}

TriangleSurface box(const Vec3& low, const Vec3& high) {
  TriangleSurface surface;
  surface.vertices.resize(3, 8);
  for (int v = 0; v < 8; ++v)
    surface.vertices.col(v) =
        Vec3(v & 1 ? high.x() : low.x(), v & 2 ? high.y() : low.y(), v & 4 ? high.z() : low.z());
  surface.triangles.resize(3, 12);
  surface.triangles << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
      2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,                   //
      3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
  return surface;
}

double signed_distance(const ClosestPointIndex& index, const Vec3& x) {
  const double distance = index.closest(x).distance_mm;
  return index.contains(x) ? -distance : distance;
}

TEST(SignedDistanceGrid, NodesAreExactNearTheSurfaceAndHardlyTooFarElsewhere) {
  for (const TriangleSurface& surface :
       {peanut(1.5), ellipsoid_surface(kCentre, Vec3(18, 13, 9), 1.2),
        box(kCentre - Vec3(4, 6, 9), kCentre + Vec3(5, 7, 8))}) {
    ASSERT_TRUE(is_closed(surface));
    ASSERT_GT(enclosed_volume(surface), 0.0);
    const ClosestPointIndex index = voxel_index_of(surface);
    DistanceGridOptions options;
    options.spacing_mm = 0.73;
    options.margin_mm = 9.0;
    const auto grid = value_or_fail(signed_distance_grid(index, options));
    EXPECT_EQ(grid.values.size(), grid.num_nodes());
    Random random(3);
    double worst_near = 0.0, worst_far = 0.0;
    int inside = 0;
    for (int repetition = 0; repetition < 6000; ++repetition) {
      const auto pick = [&](int axis) {
        return static_cast<int>(
            random.index(static_cast<std::uint64_t>(grid.dims[static_cast<std::size_t>(axis)])));
      };
      const int i = pick(0), j = pick(1), k = pick(2);
      const double truth = signed_distance(index, grid.node(i, j, k));
      const double error = std::abs(grid.values[grid.index(i, j, k)]) - std::abs(truth);
      if (std::abs(truth) > 1e-6) {
        ASSERT_EQ(grid.values[grid.index(i, j, k)] < 0.0f, truth < 0.0)
            << i << ' ' << j << ' ' << k;
      }
      inside += truth < 0.0 ? 1 : 0;
      EXPECT_GT(error, -1e-5);
      double& worst = std::abs(truth) < 2.9 * options.spacing_mm ? worst_near : worst_far;
      worst = std::max(worst, std::abs(error));
    }
    EXPECT_GT(inside, 100);
    EXPECT_LT(worst_near, 1e-5);
    EXPECT_LT(worst_far, 0.05 * options.spacing_mm);
  }
}

TEST(SignedDistanceGrid, SameBitsWhateverTheNumberOfThreads) {
  const ClosestPointIndex index = voxel_index_of(peanut(2.0));
  DistanceGridOptions options;
  options.threads = 1;
  const auto one = value_or_fail(signed_distance_grid(index, options));
  options.threads = 3;
  const auto three = value_or_fail(signed_distance_grid(index, options));
  EXPECT_EQ(one.values, three.values);
}

TEST(SignedDistanceGrid, SpacingGrowsUntilTheNodesFit) {
  const ClosestPointIndex index = voxel_index_of(peanut(3.0));
  DistanceGridOptions options;
  options.max_nodes = 20000;
  const auto grid = value_or_fail(signed_distance_grid(index, options));
  EXPECT_LE(grid.num_nodes(), 20000u);
  EXPECT_GT(grid.num_nodes(), 10000u);
  EXPECT_GT(grid.spacing_mm, 0.5);
  EXPECT_LT(signed_distance(index, kCentre), 0.0);
  EXPECT_LT(DistanceVolume::create(grid)->at(kCentre).distance_mm, 0.0);
}

TEST(SignedDistanceGrid, RejectsOpenSurfacesAndOptionsOutOfRange) {
  TriangleSurface open = peanut(3.0);
  open.triangles.conservativeResize(3, open.num_triangles() - 1);
  const auto refused = [](const ClosestPointIndex& index, const DistanceGridOptions& options,
                          const std::string& naming) {
    EXPECT_THAT(refusal_of(signed_distance_grid(index, options), ErrorCode::kInvalidArgument),
                testing::HasSubstr(naming));
  };
  refused(voxel_index_of(open), {}, "is not closed");
  const ClosestPointIndex index = voxel_index_of(peanut(3.0));
  DistanceGridOptions options;
  options.spacing_mm = 0.0;
  refused(index, options, "spacing_mm = 0");
  options = {};
  options.margin_mm = std::nan("");
  refused(index, options, "margin_mm = nan");
  options = {};
  options.max_nodes = 1;
  refused(index, options, "max_nodes = 1");
}

// h^2 / (4 R) for the sphere itself; its triangles' chords lie inside it by a^2 / (8 R), a their
// edge.
TEST(DistanceVolume, InterpolationErrorFallsWithTheSquareOfTheSpacing) {
  const double radius = 12.0, edge = 0.5;
  const ClosestPointIndex index =
      voxel_index_of(ellipsoid_surface(kCentre, Vec3::Constant(radius), edge));
  double previous = 0.0;
  for (const double spacing : {2.0, 1.0}) {
    DistanceGridOptions options;
    options.spacing_mm = spacing;
    options.margin_mm = 6.0;
    const auto volume =
        value_or_fail(DistanceVolume::create(*signed_distance_grid(index, options)));
    Random random(4);
    double worst = 0.0;
    for (int i = 0; i < 5000; ++i) {
      const double r = radius + 2.0 * (2.0 * random.uniform() - 1.0);
      const Vec3 x = kCentre + r * random.direction();
      worst = std::max(worst, std::abs(volume.at(x).distance_mm - (r - radius)));
    }
    const double chord = edge * edge / (8.0 * radius) * 2.0;
    EXPECT_LT(worst, spacing * spacing / (4.0 * (radius - 2.0)) + chord);
    EXPECT_GT(worst, spacing * spacing / (8.0 * radius));
    if (previous > 0.0) {
      EXPECT_GT(previous / worst, 3.0);
    }
    previous = worst;
  }
}

TEST(DistanceVolume, DefaultSpacingErrsByHundredthsOfAMillimetre) {
  const TriangleSurface surface = ellipsoid_surface(kCentre, Vec3(18, 13, 9), 0.75);
  const ClosestPointIndex index = voxel_index_of(surface);
  const auto volume = value_or_fail(DistanceVolume::create(*signed_distance_grid(index)));
  Random random(5);
  double worst = 0.0, sum_of_squares = 0.0;
  const Points on_surface = sample_surface(surface, 4000, 5);
  for (const Vec3 p : on_surface.colwise()) {
    const Vec3 x = p + 1.0 * random.uniform() * random.direction();
    const double error = volume.at(x).distance_mm - signed_distance(index, x);
    worst = std::max(worst, std::abs(error));
    sum_of_squares += error * error;
  }
  EXPECT_LT(worst, 0.03);
  EXPECT_LT(std::sqrt(sum_of_squares / 4000), 0.006);
}

TEST(DistanceVolume, GradientIsThatOfTheInterpolant) {
  const auto volume =
      value_or_fail(DistanceVolume::create(*signed_distance_grid(voxel_index_of(peanut(1.5)))));
  Random random(6);
  const double step = 1e-5, h = volume.grid().spacing_mm;
  int compared = 0;
  for (int i = 0; i < 500; ++i) {
    const Vec3 x = kCentre + 20.0 * random.uniform() * random.direction();
    const Vec3 cells = (x - volume.grid().origin_mm) / h;
    if (((cells - cells.array().round().matrix()).array().abs() < 2.0 * step / h).any()) continue;
    const DistanceSample here = volume.at(x);
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 dx = step * Vec3::Unit(axis);
      const double slope =
          (volume.at(x + dx).distance_mm - volume.at(x - dx).distance_mm) / (2.0 * step);
      EXPECT_NEAR(slope, here.gradient[axis], 1e-6);
    }
    EXPECT_GT(here.gradient.norm(), 0.3);
    ++compared;
  }
  EXPECT_GT(compared, 400);
}

TEST(DistanceVolume, GoesOnOutsideTheGrid) {
  const TriangleSurface surface = ellipsoid_surface(kCentre, Vec3(18, 13, 9), 1.2);
  const ClosestPointIndex index = voxel_index_of(surface);
  DistanceGridOptions options;
  options.margin_mm = 5.0;
  const auto volume = value_or_fail(DistanceVolume::create(*signed_distance_grid(index, options)));
  Random random(7);
  for (int i = 0; i < 500; ++i) {
    const Vec3 x = kCentre + (40.0 + 60.0 * random.uniform()) * random.direction();
    const DistanceSample sample = volume.at(x);
    const ClosestPoint closest = index.closest(x);
    EXPECT_NEAR(sample.distance_mm, closest.distance_mm, 0.1 * closest.distance_mm);
    EXPECT_GT(sample.gradient.dot(x - closest.point) / closest.distance_mm, 0.9);
  }
  // Continuous where the grid ends.
  const double h = volume.grid().spacing_mm;
  const Vec3 rim = volume.grid().origin_mm + h * Vec3(0.0, 20.3, 20.6);
  EXPECT_NEAR(volume.at(rim - Vec3(1e-7, 0, 0)).distance_mm,
              volume.at(rim + Vec3(1e-7, 0, 0)).distance_mm, 1e-6);
  EXPECT_TRUE(std::isfinite(volume.at(Vec3(1e9, -1e9, 1e9)).distance_mm));
}

TEST(DistanceVolume, ManyPointsAreTheSameAsOneByOne) {
  const auto volume =
      value_or_fail(DistanceVolume::create(*signed_distance_grid(voxel_index_of(peanut(3.0)))));
  Random random(8);
  PointRows points(50, 3), gradients(50, 3);
  VecX distances(50);
  for (int i = 0; i < 50; ++i)
    points.row(i) = kCentre + 60.0 * random.uniform() * random.direction();
  volume.at(points, distances, gradients);
  for (int i = 0; i < 50; ++i) {
    const DistanceSample sample = volume.at(Vec3(points.row(i)));
    EXPECT_EQ(distances[i], sample.distance_mm);
    EXPECT_EQ(Vec3(gradients.row(i)), sample.gradient);
  }
}

TEST(DistanceVolume, RejectsGridsThatDoNotFit) {
  DistanceGrid good;
  good.spacing_mm = 1.0;
  good.dims = {2, 2, 3};
  good.values.assign(12, 1.0f);
  ASSERT_TRUE(DistanceVolume::create(good));
  const auto refused = [](const DistanceGrid& grid, ErrorCode code, const std::string& naming) {
    EXPECT_THAT(refusal_of(DistanceVolume::create(grid), code), testing::HasSubstr(naming));
  };
  refused({}, ErrorCode::kEmptySet, "no values");
  DistanceGrid grid = good;
  grid.dims = {1, 4, 3};
  refused(grid, ErrorCode::kInvalidArgument, "1 x 4 x 3 nodes");
  grid = good;
  grid.values.push_back(0.0f);
  refused(grid, ErrorCode::kInvalidArgument, "13 values for 2 x 2 x 3");
  grid = good;
  grid.spacing_mm = -1.0;
  refused(grid, ErrorCode::kInvalidArgument, "spacing_mm = -1.0");
  grid = good;
  grid.origin_mm.y() = std::numeric_limits<double>::infinity();
  refused(grid, ErrorCode::kNotFinite, "origin_mm");
  grid = good;
  grid.values[7] = std::nanf("");
  refused(grid, ErrorCode::kNotFinite, "value 7");
}

}  // namespace
}  // namespace brainshift::geometry
