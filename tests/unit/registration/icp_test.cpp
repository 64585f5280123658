// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/icp.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "common/core/random.hpp"
#include "common/geometry/surface.hpp"
#include "common/registration/pose_information.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/registration/known_motion.hpp"

namespace brainshift::registration {
namespace {

Vec3 normal_vector(Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {x, y, z};
}

using geometry::ClosestPointIndex;
using test::kCentre;
using test::kDegree;
using test::motion;
using test::placement_error;

ClosestPointIndex index_of(const TriangleSurface& surface) {
  return value_or_fail(ClosestPointIndex::build(surface));
}

TriangleSurface ellipsoid() { return geometry::ellipsoid_surface(kCentre, Vec3(18, 13, 9), 1.5); }

// An ellipsoid with a bump, so that no rotation maps it onto itself.
TriangleSurface bumpy() {
  TriangleSurface surface = geometry::ellipsoid_surface(Vec3::Zero(), Vec3(15, 12, 11), 1.2);
  for (auto x : surface.vertices.colwise()) {
    const double bump = std::exp(-(x.normalized() - Vec3(0.6, 0.64, 0.48)).squaredNorm() / 0.3);
    x *= 1.0 + 0.35 * bump + 0.1 * std::sin(0.3 * x.y());
  }
  surface.vertices.colwise() += kCentre;
  return surface;
}

double rotation_error_deg(const RigidTransform& a, const RigidTransform& b) {
  return rotation_vector(a.linear() * b.linear().transpose()).norm() / kDegree;
}

IcpOptions without_prior() {
  IcpOptions options;
  options.rotation_sd_deg = 0.0;
  return options;
}

// Boundary points as they would be traced: surface points moved by T_points_surface, plus noise.
Points traced(const Points& on_surface, const RigidTransform& T_points_surface, double noise_mm,
              Random& random) {
  Points points(3, on_surface.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    points.col(i) = T_points_surface * Vec3(on_surface.col(i)) + noise_mm * normal_vector(random);
  return points;
}

TEST(Icp, RecoversKnownMotionsExactlyWithoutNoise) {
  for (const TriangleSurface& surface : {ellipsoid(), bumpy()}) {
    const ClosestPointIndex index = index_of(surface);
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      Random random(seed);
      const Points on_surface = geometry::sample_surface(surface, 300, seed);
      const RigidTransform T_points_surface = motion(random, 4.0, 6.0);
      const Points points = traced(on_surface, T_points_surface, 0.0, random);
      const auto result =
          value_or_fail(align(points, index, RigidTransform::Identity(), without_prior()));
      EXPECT_TRUE(result.converged);
      EXPECT_LT(result.iterations, 30);
      EXPECT_LT(result.rms_mm, 1e-4);
      EXPECT_LT(placement_error(result.T_surface_points, T_points_surface.inverse(), points), 1e-4)
          << "seed " << seed;
      EXPECT_EQ(result.observable_axes, 6);
      EXPECT_TRUE(result.rotation_observable);
    }
  }
}

TEST(Icp, ErrorWithNoiseIsWithinItsStatistics) {
  const TriangleSurface surface = bumpy();
  const ClosestPointIndex index = index_of(surface);
  const double noise = 0.5;
  const int count = 400;
  double sum_of_squares = 0.0;
  const int runs = 10;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    Random random(100 + seed);
    const Points on_surface = geometry::sample_surface(surface, count, seed);
    const RigidTransform T_points_surface = motion(random, 4.0, 6.0);
    const Points points = traced(on_surface, T_points_surface, noise, random);
    const auto result =
        value_or_fail(align(points, index, RigidTransform::Identity(), without_prior()));
    EXPECT_TRUE(result.converged);
    EXPECT_NEAR(result.rms_mm, noise, 0.1);  // 1 / sqrt(2 * 400) of it is statistics
    sum_of_squares +=
        std::pow((result.T_surface_points * (T_points_surface * kCentre) - kCentre).norm(), 2);
  }
  // Each translation axis sees a third of the points' information: variance 3 sd^2 / count per
  // axis, a little more because rotation is estimated too.
  const double expected = std::sqrt(3.0 * 3.0 / count) * noise;
  EXPECT_LT(std::sqrt(sum_of_squares / runs), 1.6 * expected);
  EXPECT_GT(std::sqrt(sum_of_squares / runs), 0.4 * expected);
}

TEST(Icp, ConvergesFromFarWithOutliers) {
  const TriangleSurface surface = ellipsoid();
  const ClosestPointIndex index = index_of(surface);
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Random random(seed);
    const Points on_surface = geometry::sample_surface(surface, 500, seed);
    const RigidTransform T_points_surface = motion(random, 10.0, 15.0);
    Points points = traced(on_surface, T_points_surface, 0.2, random);
    for (int i = 0; i < 50; ++i)  // every tenth point is 5 to 20 mm off
      points.col(10 * i) += (5.0 + 15.0 * random.uniform()) * random.direction();
    IcpOptions options = without_prior();
    options.sd_mm = 0.2;
    options.welsch_scale_mm = 0.6;
    const auto result = value_or_fail(align(points, index, RigidTransform::Identity(), options));
    EXPECT_TRUE(result.converged) << "seed " << seed;
    EXPECT_LT(placement_error(result.T_surface_points, T_points_surface.inverse(),
                              T_points_surface * on_surface),
              0.2)
        << "seed " << seed << ", " << result.iterations << " iterations";
  }
}

TEST(Icp, AlignsPlanarSectionsOnly) {
  // Two ultrasound-like sweeps: six planar sections, not a surface full of points.
  const TriangleSurface surface = bumpy();
  const ClosestPointIndex index = index_of(surface);
  Random random(5);
  std::vector<Vec3> ends;
  for (const Vec3& normal : {Vec3(1, 0.2, 0), Vec3(0, 0.3, 1)})
    for (const double offset : {-5.0, 0.0, 5.0}) {
      const Vec3 n = normal.normalized();
      const Points section = geometry::plane_section(surface, n, n.dot(kCentre) + offset);
      for (Eigen::Index i = 0; i < section.cols(); i += 2) ends.push_back(section.col(i));
    }
  Points on_surface(3, static_cast<Eigen::Index>(ends.size()));
  for (std::size_t i = 0; i < ends.size(); ++i)
    on_surface.col(static_cast<Eigen::Index>(i)) = ends[i];
  const RigidTransform T_points_surface = motion(random, 3.0, 4.0);
  const Points points = traced(on_surface, T_points_surface, 0.2, random);
  const auto result =
      value_or_fail(align(points, index, RigidTransform::Identity(), without_prior()));
  EXPECT_TRUE(result.converged);
  EXPECT_TRUE(result.rotation_observable);
  EXPECT_LT(placement_error(result.T_surface_points, T_points_surface.inverse(), points), 0.2);
}

TEST(Icp, StartsFromTheInitialPose) {
  // Far beyond the basin, but the tracked pose is nearly right.
  const TriangleSurface surface = bumpy();
  const ClosestPointIndex index = index_of(surface);
  Random random(6);
  const RigidTransform T_points_surface = motion(random, 200.0, 120.0);
  const Points points =
      traced(geometry::sample_surface(surface, 300, 6), T_points_surface, 0.0, random);
  const RigidTransform T_initial = motion(random, 3.0, 3.0) * T_points_surface.inverse();
  const auto result = value_or_fail(align(points, index, T_initial, without_prior()));
  EXPECT_TRUE(result.converged);
  EXPECT_LT(placement_error(result.T_surface_points, T_points_surface.inverse(), points), 1e-4);
}

TEST(Icp, EndsWhenItIsTold) {
  const TriangleSurface surface = bumpy();
  const ClosestPointIndex index = index_of(surface);
  std::stop_source stop;
  stop.request_stop();
  IcpOptions options = without_prior();
  options.stop = stop.get_token();
  EXPECT_EQ(refusal_of(align(geometry::sample_surface(surface, 300, 6), index,
                             RigidTransform::Identity(), options),
                       ErrorCode::kNotConverged),
            "the alignment was stopped");
}

TEST(Icp, SphereShowsNoRotationAndKeepsTheTrackedOne) {
  const TriangleSurface sphere = geometry::ellipsoid_surface(kCentre, Vec3::Constant(13.8), 1.04);
  const ClosestPointIndex index = index_of(sphere);
  for (const double rotation_sd_deg : {0.0, 3.0}) {
    Random random(7);
    Points points(3, 500);
    const Vec3 shift = 4.0 * random.direction();
    for (int i = 0; i < 500; ++i)
      points.col(i) = kCentre + shift + (13.8 + 0.5 * random.normal()) * random.direction();
    IcpOptions options;
    options.rotation_sd_deg = rotation_sd_deg;
    Vec6 tracked;
    tracked << 0.2, -0.1, 0.05, 0, 0, 0;
    const RigidTransform T_initial = rigid_increment(tracked, kCentre + shift);
    const auto result = value_or_fail(align(points, index, T_initial, options));
    EXPECT_TRUE(result.converged);
    EXPECT_FALSE(result.rotation_observable);
    EXPECT_EQ(result.observable_axes, 3);
    EXPECT_LT(rotation_error_deg(result.T_surface_points, T_initial), 1e-6);
    // Translation is found all the same.
    EXPECT_LT((result.T_surface_points * (kCentre + shift) - kCentre).norm(), 0.15);
  }
}

TEST(Icp, HalfOfASphereShowsNoRotationEither) {
  // The centroid is not the centre, so rotation about it is mixed with translation, yet equally
  // unknown.
  const ClosestPointIndex index =
      index_of(geometry::ellipsoid_surface(kCentre, Vec3::Constant(13.8), 1.04));
  Random random(8);
  Points points(3, 400);
  for (int i = 0; i < 400; ++i) {
    Vec3 n = random.direction();
    n.z() = std::abs(n.z());
    points.col(i) = kCentre + Vec3(1, 2, -1) + 13.8 * n;
  }
  const auto result =
      value_or_fail(align(points, index, RigidTransform::Identity(), without_prior()));
  EXPECT_TRUE(result.converged);
  EXPECT_FALSE(result.rotation_observable);
  EXPECT_EQ(result.observable_axes, 3);
  EXPECT_LT((result.T_surface_points * (kCentre + Vec3(1, 2, -1)) - kCentre).norm(), 0.1);
}

TEST(Icp, SpheroidHidesTheTurnAboutItsAxisOnly) {
  const TriangleSurface surface = geometry::ellipsoid_surface(kCentre, Vec3(12, 12, 18), 1.2);
  const ClosestPointIndex index = index_of(surface);
  Random random(9);
  Vec6 xi;
  xi << 5.0 * kDegree, 0, 0, 2, -1, 1;
  const RigidTransform T_points_surface = rigid_increment(xi, kCentre);
  const Points points =
      traced(geometry::sample_surface(surface, 400, 9), T_points_surface, 0.1, random);
  const auto result =
      value_or_fail(align(points, index, RigidTransform::Identity(), without_prior()));
  EXPECT_EQ(result.observable_axes, 5);
  EXPECT_FALSE(result.rotation_observable);
  // The axis itself is found.
  const Vec3 axis = result.T_surface_points.linear() * T_points_surface.linear() * Vec3::UnitZ();
  EXPECT_LT(std::acos(std::min(1.0, axis.z())) / kDegree, 0.5);
}

TEST(Icp, PlaneShowsThreeAxes) {
  TriangleSurface plane;
  plane.vertices.resize(3, 4);
  plane.vertices << -50, 50, 50, -50, -50, -50, 50, 50, 0, 0, 0, 0;
  plane.triangles.resize(3, 2);
  plane.triangles << 0, 0, 1, 2, 2, 3;
  Random random(10);
  Points points(3, 100);
  for (int i = 0; i < 100; ++i)
    points.col(i) = Vec3(20 * random.normal(), 20 * random.normal(), 0).cwiseMax(-45).cwiseMin(45);
  Vec6 xi;
  xi << 0.05, -0.03, 0, 0, 0, 2;
  const Points moved = rigid_increment(xi, Vec3::Zero()) * points;
  const auto result =
      value_or_fail(align(moved, index_of(plane), RigidTransform::Identity(), without_prior()));
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.observable_axes, 3);
  EXPECT_FALSE(result.rotation_observable);
  EXPECT_LT((result.T_surface_points * moved).row(2).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(Icp, PriorDrawsTheRotationTowardsTheTrackedPose) {
  const TriangleSurface surface = bumpy();
  const ClosestPointIndex index = index_of(surface);
  Random random(11);
  const Points points =
      traced(geometry::sample_surface(surface, 40, 11), motion(random, 2.0, 6.0), 0.0, random);
  double previous = std::numeric_limits<double>::infinity();
  for (const double sd_deg : {100.0, 3.0, 1.0, 0.1}) {
    IcpOptions options;
    options.rotation_sd_deg = sd_deg;
    const auto result = value_or_fail(align(points, index, RigidTransform::Identity(), options));
    EXPECT_TRUE(result.converged);
    const double turned = rotation_error_deg(result.T_surface_points, RigidTransform::Identity());
    EXPECT_LT(turned, previous);
    previous = turned;
  }
  EXPECT_LT(previous, 0.5);
}

// The objective as the header states it, written without the algorithm's means.
double objective(const Points& points, const ClosestPointIndex& index, const RigidTransform& T,
                 const IcpOptions& options) {
  const double s = options.welsch_scale_mm;
  double sum = 0.0;
  for (const Vec3 p : points.colwise()) {
    const double r = index.closest(T * p).distance_mm;
    sum += 2.0 * s * s * (1.0 - std::exp(-r * r / (2.0 * s * s)));
  }
  const double angle = Eigen::AngleAxisd(T.linear()).angle();  // the initial pose is the identity
  return sum / std::pow(options.sd_mm, 2) +
         std::pow(angle / (options.rotation_sd_deg * kDegree), 2);
}

TEST(Icp, EndsInAMinimumOfItsObjective) {
  const TriangleSurface surface = bumpy();
  const ClosestPointIndex index = index_of(surface);
  for (const double sd_deg : {100.0, 3.0, 1.0}) {
    Random random(15);
    const Points points =
        traced(geometry::sample_surface(surface, 60, 15), motion(random, 2.0, 6.0), 0.3, random);
    IcpOptions options;
    options.rotation_sd_deg = sd_deg;
    const auto result = value_or_fail(align(points, index, RigidTransform::Identity(), options));
    EXPECT_TRUE(result.converged);
    const Vec3 centre = result.T_surface_points * Vec3(points.rowwise().mean());
    const double least = objective(points, index, result.T_surface_points, options);
    for (int k = 0; k < 6; ++k)
      for (const double sign : {-1.0, 1.0}) {
        const double h = k < 3 ? 0.1 * kDegree : 0.02;
        const RigidTransform beside =
            rigid_increment(sign * h * Vec6::Unit(k), centre) * result.T_surface_points;
        EXPECT_GT(objective(points, index, beside, options), least) << "axis " << k;
      }
  }
}

TEST(Icp, RepeatsBitForBit) {
  const TriangleSurface surface = bumpy();
  const ClosestPointIndex index = index_of(surface);
  Random random(12);
  const Points points =
      traced(geometry::sample_surface(surface, 200, 12), motion(random, 4.0, 6.0), 0.3, random);
  const auto first = value_or_fail(align(points, index, RigidTransform::Identity()));
  const auto second = value_or_fail(align(points, index_of(surface), RigidTransform::Identity()));
  EXPECT_EQ(first.T_surface_points.matrix(), second.T_surface_points.matrix());
}

TEST(Icp, SaysWhenItRanOutOfIterations) {
  const TriangleSurface surface = ellipsoid();
  Random random(13);
  const Points points =
      traced(geometry::sample_surface(surface, 200, 13), motion(random, 8.0, 10.0), 0.3, random);
  IcpOptions options;
  options.max_iterations = 2;
  const auto result =
      value_or_fail(align(points, index_of(surface), RigidTransform::Identity(), options));
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.iterations, 2);
}

TEST(Icp, StaysFiniteWhenEveryPointIsFarAway) {
  const Points points = geometry::sample_surface(ellipsoid(), 50, 1).colwise() + Vec3(0, 0, 5000);
  IcpOptions options;
  options.max_iterations = 5;
  const auto result =
      value_or_fail(align(points, index_of(ellipsoid()), RigidTransform::Identity(), options));
  EXPECT_TRUE(result.T_surface_points.matrix().allFinite());
  EXPECT_TRUE(std::isfinite(result.rms_mm));
}

TEST(Icp, TranslationOnlyKeepsTheOrientationAndFindsATranslation) {
  const TriangleSurface surface = bumpy();
  const auto index = index_of(surface);
  Random random(3);
  const RigidTransform T_points_surface = motion(random, 4.0, 0.0);
  IcpOptions options;
  options.rotation = false;
  const auto result = value_or_fail(align(traced(surface.vertices, T_points_surface, 0.0, random),
                                          index, RigidTransform::Identity(), options));
  EXPECT_TRUE(result.T_surface_points.linear().isIdentity(1e-12));
  EXPECT_LT((T_points_surface.translation() + result.T_surface_points.translation()).norm(), 1e-3);
  EXPECT_TRUE(result.rotation_observable);
}

// The true difference: where the aligned points go with rotation and without.
TEST(Icp, EstimateForRotationLeftOutBoundsTheTrueDifference) {
  Random random(11);
  double greatest = 0.0;
  for (const TriangleSurface& surface : {ellipsoid(), bumpy()}) {
    const auto index = index_of(surface);
    for (const double rotation_deg : {0.0, 3.0, 10.0}) {
      for (int repetition = 0; repetition < 2; ++repetition) {
        const Points points =
            traced(surface.vertices, motion(random, 2.0, rotation_deg), 0.3, random);
        IcpOptions options;
        const auto with = value_or_fail(align(points, index, RigidTransform::Identity(), options));
        options.rotation = false;
        const auto without =
            value_or_fail(align(points, index, RigidTransform::Identity(), options));
        const double truth =
            placement_error(with.T_surface_points, without.T_surface_points, points);
        EXPECT_LE(truth, without.left_out_rotation_mm) << rotation_deg;
        EXPECT_LE(without.left_out_rotation_mm, 10.0 * std::max(0.3, truth)) << rotation_deg;
        EXPECT_EQ(with.left_out_rotation_mm, 0.0);
        greatest = std::max(greatest, truth);
      }
    }
  }
  EXPECT_GT(greatest, 1.0);
}

// A ball shows no rotation. The true motion may be any that the prior allows, up to two standard
// deviations of it.
TEST(Icp, EstimateForUnobservableRotationBoundsRotationsWithinThePrior) {
  const TriangleSurface ball = geometry::ellipsoid_surface(kCentre, Vec3(12, 12, 12), 1.5);
  const auto index = index_of(ball);
  Random random(5);
  for (const double rotation_deg : {1.0, 3.0, 6.0}) {
    const RigidTransform T_points_surface = motion(random, 2.0, rotation_deg);
    const Points points = traced(ball.vertices, T_points_surface, 0.0, random);
    const auto result = value_or_fail(align(points, index, RigidTransform::Identity()));
    ASSERT_FALSE(result.rotation_observable);
    const double truth =
        placement_error(result.T_surface_points, T_points_surface.inverse(), points);
    EXPECT_GT(truth, 0.1);
    EXPECT_LE(truth, result.left_out_rotation_mm) << rotation_deg;
    EXPECT_LE(result.left_out_rotation_mm, 2.5);
  }
}

TEST(Icp, RotationThatNothingHoldsHasNoBound) {
  const TriangleSurface surface = ellipsoid();
  IcpOptions options = without_prior();
  // Every point an outlier: no information.
  const Points far = surface.vertices.colwise() + Vec3(0, 0, 1e4);
  options.max_iterations = 1;
  options.welsch_scale_mm = 1e-3;
  const auto result =
      value_or_fail(align(far, index_of(surface), RigidTransform::Identity(), options));
  EXPECT_EQ(result.left_out_rotation_mm, std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace brainshift::registration
