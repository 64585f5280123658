// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <numbers>

#include "common/core/random.hpp"
#include "common/registration/alignment_data.hpp"
#include "common/registration/surface_distances.hpp"
#include "tests/support/toy_patient.hpp"
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

TEST(CraniotomyPatch, HoldsTheBoundaryTrianglesBetweenCraniotomyNodes) {
  const BrainModel patient = test_support::toy_patient(8);
  const SurfacePatch patch = craniotomy_patch(patient);
  ASSERT_GT(patch.surface.num_triangles(), 4);
  EXPECT_EQ(patch.nodes.size(), patient.craniotomy.size());
  for (int t = 0; t < patch.surface.num_triangles(); ++t) {
    const auto corners = patch.surface.triangles.col(t);
    const Vec3 a = patch.surface.vertices.col(corners[0]);
    const Vec3 n = (Vec3(patch.surface.vertices.col(corners[1])) - a)
                       .cross(Vec3(patch.surface.vertices.col(corners[2])) - a);
    EXPECT_GT(n.z(), 0.0) << "outwards is up";
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(patch.surface.vertices.col(corners[k]),
                patient.mesh.nodes.col(patch.nodes[static_cast<std::size_t>(corners[k])]));
    }
  }
  EXPECT_EQ(craniotomy_patch(BrainModel{}).surface.num_triangles(), 0);
}

TEST(CraniotomyPatch, MovesWithItsNodes) {
  const SurfacePatch patch = craniotomy_patch(test_support::toy_patient(8));
  const Points u = Points::Random(3, static_cast<Eigen::Index>(patch.nodes.size()));
  EXPECT_EQ(Points(u * patch.weights), u);
}

TEST(TumourPatch, MovesAsTheTissueAroundItsVertices) {
  const BrainModel patient = test_support::toy_patient(8);
  const SurfacePatch patch = tumour_patch(patient);
  EXPECT_EQ(patch.surface.vertices, patient.tumour.vertices);
  EXPECT_EQ(patch.surface.triangles, patient.tumour.triangles);
  EXPECT_TRUE(std::is_sorted(patch.nodes.begin(), patch.nodes.end()));
  EXPECT_LT(patch.nodes.size(), static_cast<std::size_t>(patient.mesh.num_nodes()) / 2);
  // Linear elements carry a linear field exactly.
  Mat3 gradient;
  gradient << 0.1, -0.3, 0.2, 0.05, 0.2, -0.1, 0.0, 0.4, -0.2;
  const Points u =
      (gradient * patient.mesh.nodes(Eigen::all, patch.nodes)).colwise() + Vec3(1, 2, 3);
  const Points expected = (gradient * patient.tumour.vertices).colwise() + Vec3(1, 2, 3);
  EXPECT_LT((u * patch.weights - expected).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(TumourPatch, VerticesOutsideTheMeshMoveWithItsClosestPoint) {
  BrainModel patient = test_support::toy_patient(8);
  patient.tumour.vertices.row(2).array() += 18.0;  // its top is 8 mm above the brain's
  const SurfacePatch patch = tumour_patch(patient);
  const Points heights = patient.mesh.nodes(Eigen::all, patch.nodes);
  const Points seen = heights * patch.weights;
  for (int v = 0; v < patch.surface.num_vertices(); ++v) {
    EXPECT_NEAR(seen(2, v), std::min(60.0, patch.surface.vertices(2, v)), 1e-9);
  }
}

}  // namespace
}  // namespace brainshift::registration
