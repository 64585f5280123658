// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "common/core/random.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"
#include "common/registration/pose_information.hpp"

namespace brainshift::registration {
namespace {

Vec3 normal_increment(Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {x, y, z};
}

TEST(RigidIncrement, IsRigidAndMovesTheCentreByTheTranslation) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    Vec6 xi;
    xi << normal_increment(random), 10.0 * normal_increment(random);
    const Vec3 centre = 50.0 * normal_increment(random);
    const RigidTransform T = rigid_increment(xi, centre);
    EXPECT_LT((T.linear().transpose() * T.linear() - Mat3::Identity()).norm(), 1e-14);
    EXPECT_NEAR(T.linear().determinant(), 1.0, 1e-14);
    EXPECT_LT((T * centre - centre - xi.tail<3>()).norm(), 1e-12);
  }
}

TEST(RigidIncrement, QuarterTurnByHand) {
  Vec6 xi;
  xi << 0, 0, std::numbers::pi / 2, 5, 0, 0;
  const RigidTransform T = rigid_increment(xi, Vec3(1, 1, 0));
  // (2, 1) is 1 to the right of the centre: it turns to 1 above it, then shifts by 5.
  EXPECT_LT((T * Vec3(2, 1, 7) - Vec3(6, 2, 7)).norm(), 1e-14);
}

TEST(RigidIncrement, OfZeroIsTheIdentity) {
  EXPECT_EQ(rigid_increment(Vec6::Zero(), Vec3(1, 2, 3)).matrix(), Eigen::Matrix4d::Identity());
}

TEST(RotationVector, InvertsTheExponential) {
  Random random(2);
  for (const double angle : {0.0, 1e-9, 1e-4, 0.3, 2.0, 3.1}) {
    Vec6 xi = Vec6::Zero();
    xi.head<3>() = angle * random.direction();
    const Mat3 rotation = rigid_increment(xi, Vec3::Zero()).linear();
    EXPECT_LT((rotation_vector(rotation) - xi.head<3>()).norm(), 1e-12);
  }
}

TEST(DirectionGradient, IsTheDerivativeOfTheMovedPoint) {
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const Vec3 x = 20.0 * normal_increment(random), centre = 20.0 * normal_increment(random);
    const Vec3 n = random.direction();
    const Vec6 gradient = direction_gradient(x, n, centre);
    EXPECT_GT(gradient.head<3>().norm(), 0.1);  // else the comparison shows nothing
    const double h = 1e-5;
    for (int k = 0; k < 6; ++k) {
      const Vec6 step = h * Vec6::Unit(k);
      const double difference =
          (n.dot(rigid_increment(step, centre) * x) - n.dot(rigid_increment(-step, centre) * x)) /
          (2.0 * h);
      EXPECT_NEAR(gradient[k], difference, 1e-7);
    }
  }
}

TEST(DirectionGradient, IsTheDerivativeOfTheDistanceToASurface) {
  // The closest point moves too, but along the surface, so the distance is unchanged to first
  // order.
  const auto surface = geometry::ClosestPointIndex::build(
      geometry::ellipsoid_surface(Vec3(1, 2, 3), Vec3(15, 12, 9), 2.0));
  ASSERT_TRUE(surface);
  Random random(4);
  int inside = 0;
  for (int i = 0; i < 50; ++i) {
    const Vec3 x = Vec3(1, 2, 3) + (i % 2 ? 20.0 : 5.0) * random.direction();
    const Vec3 centre = 5.0 * normal_increment(random);
    const geometry::ClosestPoint closest = surface->closest(x);
    const Vec3 away = (x - closest.point) / closest.distance_mm;
    const Vec6 gradient = direction_gradient(x, away, centre);
    EXPECT_GT(gradient.norm(), 1.0 - 1e-12);
    const double h = 1e-6;
    for (int k = 0; k < 6; ++k) {
      const Vec6 step = h * Vec6::Unit(k);
      const double difference = (surface->closest(rigid_increment(step, centre) * x).distance_mm -
                                 surface->closest(rigid_increment(-step, centre) * x).distance_mm) /
                                (2.0 * h);
      EXPECT_NEAR(gradient[k], difference, 1e-4);
    }
    inside += surface->contains(x);
  }
  EXPECT_GT(inside, 10);
}

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Observability, SaysWhichAxesThePointsDoNotShow) {
  Observability seen;
  seen.threshold = 0.01;
  seen.rotation_ratios = Vec3(0.001, 0.2, 0.3);
  seen.rotation_axes.col(0) = -Vec3(0.1, 0.9, 0.2).normalized();
  seen.translation_ratios = Vec3(0.0, 0.009, 1.0);
  EXPECT_THAT(not_shown(seen),
              ElementsAre("rotation about (0.11, 0.97, 0.22) is not shown by the points",
                          "translation along (1.00, 0.00, 0.00) is not shown by the points",
                          "translation along (0.00, 1.00, 0.00) is not shown by the points"));
  seen.rotation_ratios.setZero();
  seen.translation_ratios.setOnes();
  EXPECT_THAT(not_shown(seen), ElementsAre("no rotation is shown by the points"));
  seen.rotation_ratios.setOnes();
  EXPECT_THAT(not_shown(seen), IsEmpty());
}

// Every number of points, so that each remainder of four is met.
TEST(PoseInformation, IsTheSumOfOuterProducts) {
  Random random(1);
  for (int count = 1; count <= 13; ++count) {
    geometry::PointRows points(count, 3), gradients(count, 3);
    VecX residuals(count), weights(count);
    const Vec3 centre(1, -2, 3);
    const double sd = 0.4, radius = 2.5;
    Mat6 hessian = Mat6::Zero();
    Vec6 gradient = Vec6::Zero();
    for (int i = 0; i < count; ++i) {
      points.row(i) = 5.0 * random.direction();
      gradients.row(i) = random.direction();
      residuals[i] = random.normal();
      weights[i] = random.uniform();
      Vec6 row = direction_gradient(points.row(i), gradients.row(i), centre);
      row.head<3>() /= radius;
      hessian += weights[i] / (sd * sd) * row * row.transpose();
      gradient += weights[i] / (sd * sd) * residuals[i] * row;
    }
    const PoseInformation information =
        pose_information(points, gradients, residuals, weights, sd, centre, radius);
    EXPECT_LT((information.hessian - hessian).norm(), 1e-11 * hessian.norm());
    EXPECT_LT((information.gradient - gradient).norm(), 1e-11 * gradient.norm());
  }
}

PoseInformation diagonal(const Vec6& known, double radius_mm) {
  PoseInformation information;
  information.hessian = known.asDiagonal();
  information.radius_mm = radius_mm;
  return information;
}

TEST(PoseCovariance, IsTheInverseOfDataAndPriorInRadiansAndMillimetres) {
  const double radius = 10.0, prior = 50.0;
  Vec6 known;
  known << 4, 8, 16, 30, 60, 90;
  const PoseInformation information = diagonal(known, radius);
  const Mat6 covariance =
      pose_covariance(information, observability(information, 1e-2), true, prior);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(covariance(k, k), 1.0 / (known[k] * radius * radius + prior), 1e-9);
    EXPECT_NEAR(covariance(3 + k, 3 + k), 1.0 / known[3 + k], 1e-6);
  }
  EXPECT_LT((covariance - Mat6(covariance.diagonal().asDiagonal())).norm(), 1e-12);
}

TEST(PoseCovariance, AxesThatAreNotShownAreAtThePrior) {
  Vec6 known;
  known << 4, 0.01, 16, 30, 60, 0.02;
  const PoseInformation information = diagonal(known, 10.0);
  const Observability seen = observability(information, 1e-2);
  const Mat6 with_prior = pose_covariance(information, seen, true, 50.0);
  EXPECT_NEAR(with_prior(1, 1), 1.0 / 50.0, 1e-9);
  EXPECT_NEAR(with_prior(5, 5), 1e6, 1.0);
  EXPECT_NEAR(with_prior(4, 4), 1.0 / 60.0, 1e-6);
  const Mat6 without = pose_covariance(information, seen, true, 0.0);
  EXPECT_NEAR(std::sqrt(without(1, 1)), kUnknownRotationSd_rad, 1e-6);
  const Mat6 held = pose_covariance(information, seen, false, 50.0);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(held(k, k), 1.0 / 50.0, 1e-9);
}

// Rotation about z can be traded against translation along x, as for half of a sphere. The
// translation shares the uncertainty of the rotation.
TEST(PoseCovariance, KeepsWhatAnUnknownRotationLeavesOpenInTheTranslation) {
  Vec6 known;
  known << 4, 8, 16, 30, 60, 90;
  PoseInformation information = diagonal(known, 10.0);
  information.hessian(2, 2) = 16.0 * 16.0 / 30.0 + 1e-4;
  information.hessian(2, 3) = information.hessian(3, 2) = 16.0;
  const Observability seen = observability(information, 1e-2);
  ASSERT_FALSE(seen.rotation_shown(0));
  ASSERT_TRUE(seen.rotation_shown(1));
  const double prior = 50.0;
  const Mat6 covariance = pose_covariance(information, seen, true, prior);
  EXPECT_NEAR(covariance(2, 2), 1.0 / prior, 1e-7);
  // t_x = -(16 / 30) * radius * w_z + noise.
  const double slope = 16.0 / 30.0 * 10.0;
  EXPECT_NEAR(covariance(3, 3), 1.0 / 30.0 + slope * slope / prior, 1e-5);
  EXPECT_NEAR(covariance(2, 3), -slope / prior, 1e-6);
}

TEST(Observability, OfNothingIsNothing) {
  const Observability seen = observability(diagonal(Vec6::Zero(), 1.0), 0.0);
  EXPECT_FALSE(seen.rotation_shown(2));
  EXPECT_FALSE(seen.translation_shown(2));
}

}  // namespace
}  // namespace brainshift::registration
