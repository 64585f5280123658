// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/alignment_data.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace brainshift::registration
