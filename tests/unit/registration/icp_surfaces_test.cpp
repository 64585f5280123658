// SPDX-License-Identifier: GPL-3.0-or-later
// Alignment to interpolated distances; covariance, weights and sentences of the result.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <string>

#include "common/core/random.hpp"
#include "common/geometry/distance_volume.hpp"
#include "common/geometry/surface.hpp"
#include "common/registration/icp.hpp"
#include "tests/support/dense.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/registration/known_motion.hpp"

namespace brainshift::registration {
namespace {

// A surface as ICP sees it: triangles and a distance volume of one sphere measure alike.

using geometry::PointRows;

const Vec3 kSphereCentre(5, -3, 8);
const TriangleSurface& sphere() {
  static const TriangleSurface surface =
      geometry::ellipsoid_surface(kSphereCentre, Vec3(12, 12, 12), 0.6);
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
    points.row(i) = kSphereCentre + radius * random.direction();
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
    const Vec3 arm = points.row(i).transpose() - kSphereCentre;
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
    const Vec3 outwards = (vertices.row(i).transpose() - kSphereCentre).normalized();
    // Normals of neighbouring facets differ by about the edge over the radius, 0.05.
    EXPECT_GT(measured.gradients.row(i).dot(outwards), 0.99);
  }
}

using test::kCentre;
using test::kDegree;
using test::motion;
using test::placement_error;

TriangleSurface bumpy_surface() {
  TriangleSurface surface = geometry::ellipsoid_surface(Vec3::Zero(), Vec3(17, 13, 10), 1.2);
  for (auto x : surface.vertices.colwise()) {
    const double bump = std::exp(-(x.normalized() - Vec3(0.6, 0.64, 0.48)).squaredNorm() / 0.3);
    x *= 1.0 + 0.25 * bump;
  }
  surface.vertices.colwise() += kCentre;
  return surface;
}

geometry::DistanceVolume volume_of(const TriangleSurface& surface) {
  const auto index = geometry::ClosestPointIndex::build(surface).value();
  return geometry::DistanceVolume::create(geometry::signed_distance_grid(index).value()).value();
}

Points traced_surface(const Points& on_surface, const RigidTransform& T, double noise_mm,
                      Random& random) {
  Points points = (T.linear() * on_surface).colwise() + Vec3(T.translation());
  for (double& value : points.reshaped()) value += noise_mm * random.normal();
  return points;
}

IcpOptions surface_without_prior(double sd_mm) {
  IcpOptions options;
  options.sd_mm = sd_mm;
  options.rotation_sd_deg = 0.0;
  return options;
}

TEST(IcpOnDistances, EndsWhereSearchedTrianglesEnd) {
  const TriangleSurface surface = bumpy_surface();
  const auto index = geometry::ClosestPointIndex::build(surface).value();
  const auto volume = volume_of(surface);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Random random(seed);
    const Points points = traced_surface(geometry::sample_surface(surface, 500, seed),
                                         motion(random, 5.0, 8.0), 0.3, random);
    const auto exact =
        value_or_fail(align(points, index, RigidTransform::Identity(), surface_without_prior(0.3)));
    const auto fast = value_or_fail(
        align(points, volume, RigidTransform::Identity(), surface_without_prior(0.3)));
    EXPECT_TRUE(fast.converged);
    // Below the error of a pose from 500 points with 0.3 mm: 0.3 sqrt(6 / 500) = 0.033 mm rms,
    // more at the ends.
    EXPECT_LT(placement_error(exact.T_surface_points, fast.T_surface_points, points), 0.04);
    EXPECT_NEAR(fast.rms_mm, exact.rms_mm, 1e-3);
    EXPECT_NEAR(fast.pose_covariance.trace(), exact.pose_covariance.trace(),
                0.02 * exact.pose_covariance.trace());
  }
}

TEST(IcpOnDistances, RepeatsBitForBit) {
  const TriangleSurface surface = bumpy_surface();
  Random random(12);
  const Points points = traced_surface(geometry::sample_surface(surface, 203, 12),
                                       motion(random, 4.0, 6.0), 0.3, random);
  const auto first = value_or_fail(align(points, volume_of(surface), RigidTransform::Identity()));
  const auto second = value_or_fail(align(points, volume_of(surface), RigidTransform::Identity()));
  EXPECT_EQ(first.T_surface_points.matrix(), second.T_surface_points.matrix());
  EXPECT_EQ(first.weights, second.weights);
}

TEST(IcpOnDistances, SphereShowsNoRotationAndKeepsTheOrientation) {
  const auto volume = volume_of(geometry::ellipsoid_surface(kCentre, Vec3::Constant(14.0), 1.0));
  Random random(3);
  Points points(3, 400);
  for (auto x : points.colwise()) x = kCentre + Vec3(3, -1, 2) + 14.0 * random.direction();
  const auto result =
      value_or_fail(align(points, volume, RigidTransform::Identity(), surface_without_prior(0.3)));
  EXPECT_FALSE(result.rotation_observable);
  EXPECT_EQ(result.observable_axes, 3);
  EXPECT_TRUE(result.T_surface_points.linear().isIdentity(1e-9));
  EXPECT_THAT(not_shown(result.observability),
              testing::ElementsAre("no rotation is shown by the points"));
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(std::sqrt(result.pose_covariance(k, k)), std::numbers::pi, 1e-3);
}

TEST(IcpOnDistances, NamesTheAxisOfASpheroid) {
  const auto surface = geometry::ellipsoid_surface(kCentre, Vec3(12, 12, 18), 1.2);
  Random random(4);
  const Points points = traced_surface(geometry::sample_surface(surface, 600, 4),
                                       motion(random, 1.0, 0.0), 0.0, random);
  const auto result = value_or_fail(
      align(points, volume_of(surface), RigidTransform::Identity(), surface_without_prior(0.3)));
  const auto sentences = not_shown(result.observability);
  ASSERT_EQ(sentences.size(), 1u);
  EXPECT_THAT(sentences[0], testing::HasSubstr("rotation about ("));
  EXPECT_GT(std::abs(result.observability.rotation_axes(2, 0)), 0.999);
}

TEST(IcpOnDistances, OutliersEndWithoutWeight) {
  const TriangleSurface surface = bumpy_surface();
  Random random(5);
  const RigidTransform T = motion(random, 8.0, 12.0);
  Points points = traced_surface(geometry::sample_surface(surface, 500, 5), T, 0.2, random);
  for (int i = 0; i < 500; i += 10)
    points.col(i) += 15.0 * (points.col(i) - T * kCentre).normalized();
  IcpOptions options = surface_without_prior(0.2);
  options.welsch_scale_mm = 1.0;
  const auto result =
      value_or_fail(align(points, volume_of(surface), RigidTransform::Identity(), options));
  ASSERT_EQ(result.weights.size(), 500);
  for (int i = 0; i < 500; ++i) {
    if (i % 10 == 0) {
      EXPECT_LT(result.weights[i], 1e-6);
    } else {
      EXPECT_GT(result.weights[i], 0.5);
    }
  }
  EXPECT_LT(placement_error(result.T_surface_points, T.inverse(), T * surface.vertices), 0.2);
}

// Errors of many repetitions, each by its stated covariance: the mean of xi^T C^-1 xi is 6.
TEST(IcpOnDistances, CovarianceIsThatOfTheErrors) {
  const TriangleSurface surface = bumpy_surface();
  const auto volume = volume_of(surface);
  const double noise = 0.4;
  const int runs = 300;
  Mat6 errors = Mat6::Zero(), stated = Mat6::Zero();
  double mahalanobis = 0.0;
  Random random(6);
  const Points on_surface = geometry::sample_surface(surface, 250, 6);
  const RigidTransform T = motion(random, 1.0, 2.0);
  for (int run = 0; run < runs; ++run) {
    const Points points = traced_surface(on_surface, T, noise, random);
    IcpOptions options = surface_without_prior(noise);
    options.welsch_scale_mm = 10.0;  // as good as least squares, of which the covariance is that
    const auto result = value_or_fail(align(points, volume, RigidTransform::Identity(), options));
    const RigidTransform off = T.inverse() * result.T_surface_points.inverse();
    Vec6 xi;
    xi << rotation_vector(off.linear()), off * result.centre - result.centre;
    errors += xi * xi.transpose() / runs;
    stated += result.pose_covariance / runs;
    mahalanobis += xi.dot(symmetric_inverse(result.pose_covariance) * xi) / runs;
  }
  EXPECT_NEAR(mahalanobis, 6.0, 0.7);  // standard deviation of the mean: sqrt(12 / 300) = 0.2
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(errors(k, k) / stated(k, k), 1.0, 0.3) << k;
}

TEST(IcpOnDistances, StaysFiniteFarFromTheGrid) {
  const TriangleSurface surface = bumpy_surface();
  const Points points = geometry::sample_surface(surface, 50, 1).colwise() + Vec3(0, 0, 5000);
  const auto result = value_or_fail(align(points, volume_of(surface), RigidTransform::Identity()));
  EXPECT_TRUE(result.T_surface_points.matrix().allFinite());
  EXPECT_TRUE(result.pose_covariance.allFinite());
  EXPECT_LT((result.T_surface_points * points.col(0) - kCentre).norm(), 100.0);
}

TEST(IcpOnDistances, RefusesTheSameInputs) {
  const TriangleSurface surface = bumpy_surface();
  const auto volume = volume_of(surface);
  EXPECT_THAT(sentence_of(align(surface.vertices.leftCols(2), volume, RigidTransform::Identity())),
              testing::HasSubstr("2 given"));
  IcpOptions options;
  options.sd_mm = -1.0;
  EXPECT_THAT(sentence_of(align(surface.vertices, volume, RigidTransform::Identity(), options)),
              testing::HasSubstr("icp.sd_mm = -1"));
}

// The input that align() rejects, and its messages.

TriangleSurface input_ellipsoid() {
  return geometry::ellipsoid_surface(Vec3(35, -45, 20), Vec3(18, 13, 9), 3.0);
}

void expect_refused(const Points& points, const RigidTransform& T, const IcpOptions& options,
                    ErrorCode code, const std::string& naming) {
  const auto surface = value_or_fail(geometry::ClosestPointIndex::build(input_ellipsoid()));
  EXPECT_THAT(refusal_of(align(points, surface, T, options), code),
              testing::AllOf(testing::HasSubstr(naming), testing::Not(testing::HasSubstr("\n"))));
}

TEST(Icp, RefusesPointsThatFixNoPose) {
  const RigidTransform T = RigidTransform::Identity();
  Points points = geometry::sample_surface(input_ellipsoid(), 20, 1);
  expect_refused(points.leftCols(2), T, {}, ErrorCode::kInvalidArgument, "2 given");
  expect_refused(Points(3, 0), T, {}, ErrorCode::kInvalidArgument, "0 given");
  Points line(3, 10);
  for (int i = 0; i < 10; ++i) line.col(i) = Vec3(1, 2, 3) + i * Vec3(0.1, 0.7, -0.3);
  expect_refused(line, T, {}, ErrorCode::kInvalidArgument, "one line");
  expect_refused(Vec3(1, 2, 3).replicate(1, 5), T, {}, ErrorCode::kInvalidArgument, "one line");
  points(1, 7) = std::nan("");
  expect_refused(points, T, {}, ErrorCode::kNotFinite, "point 7");
}

TEST(Icp, RefusesAnInitialPoseThatIsNotRigid) {
  const Points points = geometry::sample_surface(input_ellipsoid(), 20, 1);
  RigidTransform T = RigidTransform::Identity();
  T.linear() *= 1.01;
  expect_refused(points, T, {}, ErrorCode::kInvalidArgument, "not a rotation");
  T.linear() = -Mat3::Identity();
  expect_refused(points, T, {}, ErrorCode::kInvalidArgument, "not a rotation");
  T = RigidTransform::Identity();
  T.translation().x() = std::nan("");
  expect_refused(points, T, {}, ErrorCode::kNotFinite, "initial pose");
}

TEST(Icp, RefusesOptionsOutOfRangeByName) {
  const Points points = geometry::sample_surface(input_ellipsoid(), 20, 1);
  const auto refused = [&](auto member, auto value, const std::string& name) {
    IcpOptions options;
    options.*member = value;
    expect_refused(points, RigidTransform::Identity(), options, ErrorCode::kInvalidArgument, name);
  };
  const double nan = std::nan("");
  refused(&IcpOptions::sd_mm, 0.0, "icp.sd_mm = 0");
  refused(&IcpOptions::sd_mm, nan, "icp.sd_mm");
  refused(&IcpOptions::welsch_scale_mm, -1.0, "icp.welsch_scale_mm = -1");
  refused(&IcpOptions::max_iterations, 0, "icp.max_iterations = 0");
  refused(&IcpOptions::translation_tolerance_mm, 0.0, "icp.translation_tolerance_mm");
  refused(&IcpOptions::rotation_tolerance_deg, nan, "icp.rotation_tolerance_deg");
  refused(&IcpOptions::rotation_sd_deg, nan, "icp.rotation_sd_deg");
  refused(&IcpOptions::observability_ratio, 1.0, "icp.observability_ratio = 1");
}

}  // namespace
}  // namespace brainshift::registration
