// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/alignment_data.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "common/core/random.hpp"
#include "tests/unit/registration/known_motion.hpp"

namespace brainshift::registration {
namespace {

TEST(SparseDataFromAlignment, LeadsFromTheUndeformedToTheTracedPlace) {
  Random random(14);
  Points points(3, 30);
  for (double& value : points.reshaped()) value = 20.0 * random.normal();
  IcpResult icp;
  icp.T_surface_points = test::motion(random, 5.0, 8.0);
  const RigidTransform& T = icp.T_surface_points;
  const SparseData data = sparse_data_from_alignment(points, icp, 0.4);
  ASSERT_EQ(data.size(), 30);
  ASSERT_EQ(data.displacements.cols(), 30);
  EXPECT_EQ(data.sd_mm, VecX::Constant(30, 0.4));
  EXPECT_LT((data.positions + data.displacements - points).norm(), 1e-12);
  for (int i = 0; i < 30; ++i)
    EXPECT_LT((data.positions.col(i) - T * Vec3(points.col(i))).norm(), 1e-12);
  EXPECT_EQ(sparse_data_from_alignment(Points(3, 0), icp, 0.4).size(), 0);
}

// Variances of a point's error: the pose's translation, the prior's rotation and strains of
// kAlignmentStrainSd.
TEST(SparseDataFromAlignment, ItsCommonErrorsHaveTheVarianceOfPoseAndStrain) {
  Points points(3, 2);
  points << 10, -10, 0, 0, 0, 0;
  IcpResult icp;
  icp.pose_covariance.diagonal() << 1, 1, 1, 0.01, 0.04, 0.09;
  const double rotation_sd_deg = 2.0, turn = 2.0 * std::numbers::pi / 180.0;
  const SparseData data = sparse_data_from_alignment(points, icp, 0.4, rotation_sd_deg);
  const Mat3 variance = data.common_error.topRows<3>() * data.common_error.topRows<3>().transpose();
  const double s = kAlignmentStrainSd;
  EXPECT_NEAR(variance(0, 0), 0.01 + 100.0 * s * s, 1e-12);
  EXPECT_NEAR(variance(1, 1), 0.04 + 100.0 * (turn * turn + 0.5 * s * s), 1e-12);
  EXPECT_NEAR(variance(2, 2), 0.09 + 100.0 * (turn * turn + 0.5 * s * s), 1e-12);
  // Both points shift alike, and turn and stretch against each other.
  const Mat3 between =
      data.common_error.topRows<3>() * data.common_error.bottomRows<3>().transpose();
  EXPECT_NEAR(between(1, 1), 0.04 - 100.0 * (turn * turn + 0.5 * s * s), 1e-12);
}

Points places() {
  Points p(3, 4);
  p << 10, 14, 10, 12, 0, 0, 6, 3, 5, 5, 5, 9;
  return p;
}

TEST(PoseErrors, AreThreeShiftsAndThreeTurnsAboutTheCentroid) {
  const Eigen::MatrixXd errors = pose_errors(places(), 0.5, 2.0);
  ASSERT_EQ(errors.rows(), 12);
  ASSERT_EQ(errors.cols(), 6);
  const Vec3 centre = places().rowwise().mean();
  const VecX amplitudes = VecX::Random(6);
  const Vec3 shift = 0.5 * amplitudes.head<3>();
  const Vec3 turn = 2.0 * std::numbers::pi / 180.0 * amplitudes.tail<3>();
  const VecX together = errors * amplitudes;
  for (int i = 0; i < 4; ++i) {
    const Vec3 expected = shift + turn.cross(places().col(i) - centre);
    EXPECT_LT((together.segment<3>(3 * i) - expected).norm(), 1e-14);
  }
}

// What the header says of turns.
TEST(PoseErrors, AreARotationButForItsSecondOrder) {
  Points far(3, 2);
  far << -50, 50, 0, 0, 0, 0;
  const Eigen::MatrixXd errors = pose_errors(far, 0.0, 1.0);
  ASSERT_EQ(errors.cols(), 3);
  const double angle = std::numbers::pi / 180.0;
  const Vec3 turned = Eigen::AngleAxisd(angle, Vec3::UnitZ()) * Vec3(far.col(1));
  EXPECT_NEAR((turned - far.col(1)).norm(), 0.87, 0.005);
  EXPECT_NEAR((far.col(1) + errors.block<3, 1>(3, 2) - turned).norm(), 0.0076, 1e-4);
}

TEST(PoseErrors, ThatAreNotThereHaveNoColumn) {
  EXPECT_EQ(pose_errors(places(), 0.0, 0.0).size(), 0);
  EXPECT_EQ(pose_errors(places(), 0.3, 0.0).cols(), 3);
  EXPECT_EQ(pose_errors(Points(3, 0), 0.3, 0.3).size(), 0);
}

}  // namespace
}  // namespace brainshift::registration
