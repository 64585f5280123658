// SPDX-License-Identifier: Apache-2.0
#include "common/core/rigid_motion.hpp"
#include "tests/support/results.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <string>

namespace brainshift {
namespace {

using testing::HasSubstr;

Eigen::Matrix4d rotation(double angle) {
  RigidTransform T = RigidTransform::Identity();
  T.linear() = Eigen::AngleAxisd(angle, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  T.translation() = Vec3(100, -20, 5);
  return T.matrix();
}

void expect_not_rigid(const Eigen::Matrix4d& matrix, const std::string& says) {
  EXPECT_THAT(sentence_of(check_rigid(matrix)), HasSubstr(says)) << matrix;
}

// Rounding moves an entry by up to half of the last digit; the nearest rotation is within twice
// that.
TEST(CheckRigid, AcceptsRotationsRoundedToThreeDecimals) {
  for (const double decimals : {1e3, 1e4, 1e6}) {
    for (double angle = 0.0; angle < 3.0; angle += 0.1) {
      Eigen::Matrix4d matrix = rotation(angle);
      matrix = (matrix * decimals).array().round() / decimals;
      EXPECT_TRUE(check_rigid(matrix)) << angle;
      const RigidTransform T = nearest_rigid(matrix);
      EXPECT_LT((T.linear().transpose() * T.linear() - Mat3::Identity()).norm(), 1e-14);
      EXPECT_LT((T.matrix() - rotation(angle)).cwiseAbs().maxCoeff(), 1.0 / decimals);
    }
  }
}

TEST(CheckRigid, TakesAnotherToleranceFromItsCaller) {
  Eigen::Matrix4d matrix = rotation(0.7);
  matrix.topLeftCorner<3, 3>() *= 1.0005;
  EXPECT_TRUE(check_rigid(matrix));
  EXPECT_FALSE(check_rigid(matrix, 1e-4));
}

TEST(CheckRigid, RefusesScaleReflectionShearAndInfinity) {
  Eigen::Matrix4d matrix = rotation(0.7);
  matrix.topLeftCorner<3, 3>() *= 1.01;
  expect_not_rigid(matrix, "R^T R differs from I by 0.02");
  matrix = rotation(0.7);
  matrix.col(0) *= -1.0;
  expect_not_rigid(matrix, "reflection");
  matrix = rotation(0.7);
  matrix.col(0) += 0.1 * matrix.col(1);
  expect_not_rigid(matrix, "no rigid motion");
  matrix = rotation(0.7);
  matrix(1, 3) = std::numeric_limits<double>::quiet_NaN();
  expect_not_rigid(matrix, "finite");
  matrix = rotation(0.7);
  matrix(3, 0) = 0.5;
  expect_not_rigid(matrix, "last row");
}

TEST(CheckAffine, AcceptsPixelsAndRefusesWhatCannotBeInverted) {
  Eigen::Matrix4d matrix = rotation(0.7);
  matrix.topLeftCorner<3, 3>() *= 0.08;
  EXPECT_TRUE(check_affine(matrix));
  matrix.col(2).setZero();
  EXPECT_THAT(sentence_of(check_affine(matrix)), HasSubstr("cannot be inverted"));
}

}  // namespace
}  // namespace brainshift
