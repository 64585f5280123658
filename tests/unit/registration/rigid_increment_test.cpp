// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/rigid_increment.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "common/core/random.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"

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

}  // namespace
}  // namespace brainshift::registration
