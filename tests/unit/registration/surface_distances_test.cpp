// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/surface_distances.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "common/core/random.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::registration {
namespace {

using testing::HasSubstr;

// A cap of radius 60 mm about the z axis, 20 mm wide, as the cortex under a craniotomy. Its apex
// is at (0, 0, 60).
double cap_height(double x, double y) { return std::sqrt(3600.0 - x * x - y * y); }

SurfacePatch cap() {
  constexpr int kSide = 21;
  SurfacePatch patch;
  patch.surface.vertices.resize(3, kSide * kSide);
  std::vector<int> corners;
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      const double x = i - 10.0, y = j - 10.0;
      patch.nodes.push_back(kSide * j + i);
      patch.surface.vertices.col(kSide * j + i) = Vec3(x, y, cap_height(x, y));
      if (i + 1 == kSide || j + 1 == kSide) continue;
      const int a = kSide * j + i, b = a + 1, c = a + kSide, d = c + 1;
      for (const int corner : {a, b, d, a, d, c}) corners.push_back(corner);
    }
  }
  patch.surface.triangles = Eigen::Map<Eigen::Matrix<int, 3, Eigen::Dynamic>>(
      corners.data(), 3, static_cast<Eigen::Index>(corners.size() / 3));
  return patch;
}

Points points_on_cap(int count, double half_width, std::uint64_t seed = 1) {
  Random random(seed);
  Points points(3, count);
  for (auto p : points.colwise()) {
    const double x = half_width * (2.0 * random.uniform() - 1.0);
    const double y = half_width * (2.0 * random.uniform() - 1.0);
    p = Vec3(x, y, cap_height(x, y));
  }
  return points;
}

Points still(const SurfaceDistances& surface) {
  return Points::Zero(3, static_cast<Eigen::Index>(surface.nodes().size()));
}

SurfaceDistances built(const Points& measured, const SurfaceDistanceOptions& options = {}) {
  auto made = SurfaceDistances::build(cap(), measured, options);
  EXPECT_TRUE(made.has_value());
  return std::move(*made);
}

TEST(SurfaceDistances, OfASunkenCortexAreTheDepthAlongItsNormal) {
  const Vec3 sink(0, 0, -3);
  const SurfaceDistances surface = built(points_on_cap(400, 7.0).colwise() + sink);
  const SparseData data = surface.at(still(surface));
  ASSERT_EQ(data.size(), 300);
  for (int i = 0; i < data.size(); ++i) {
    const Vec3 n = data.directions.col(i);
    EXPECT_NEAR(n.norm(), 1.0, 1e-12);
    EXPECT_GT(n.z(), 0.95);
    // Along the normal of the undeformed surface, up to its curvature over the slide of the foot
    // point.
    EXPECT_NEAR(n.dot(data.displacements.col(i)), n.dot(sink), 0.02);
    EXPECT_LT((data.displacements.col(i) - n * n.dot(data.displacements.col(i))).norm(), 1e-12);
  }
}

TEST(SurfaceDistances, OfTheRightDeformationAreExactWhateverSlid) {
  const Vec3 move(2.5, -1.0, -3.0);
  const SurfaceDistances surface = built(points_on_cap(400, 6.0).colwise() + move);
  Points u = still(surface);
  u.colwise() += move;
  const SparseData data = surface.at(u);
  ASSERT_GT(data.size(), 200);
  for (int i = 0; i < data.size(); ++i) {
    const Vec3 n = data.directions.col(i);
    // The faces lie up to h^2 / (8 R) below the cap.
    EXPECT_NEAR(n.dot(data.displacements.col(i)), n.dot(move), 0.005) << i;
  }
  EXPECT_TRUE(surface.moved(surface.at(still(surface)), data));
  EXPECT_FALSE(surface.moved(data, data));
}

TEST(SurfaceDistances, PointsBesideThePatchGiveNoData) {
  Points measured(3, 60);
  measured.leftCols(30) = points_on_cap(30, 8.0);
  measured.rightCols(30) = points_on_cap(30, 8.0).colwise() + Vec3(25, 0, 0);
  const SurfaceDistances surface = built(measured);
  EXPECT_EQ(surface.at(still(surface)).size(), 30);
}

TEST(SurfaceDistances, TheSamePointsGuideEveryTime) {
  const Points measured = points_on_cap(1000, 8.0);
  const SurfaceDistances first = built(measured), second = built(measured);
  EXPECT_EQ(first.at(still(first)).positions, second.at(still(second)).positions);
}

TEST(SurfaceDistances, TheCamerasPoseIsACommonError) {
  SurfaceDistanceOptions options;
  options.pose_sd_mm = 0.3;
  options.pose_sd_deg = 0.5;
  const SurfaceDistances surface = built(points_on_cap(100, 8.0), options);
  const SparseData data = surface.at(still(surface));
  ASSERT_EQ(data.common_error.cols(), 6);
  const Vec3 arm = data.positions.col(5) - data.positions.rowwise().mean();
  const double turn = 0.5 * std::numbers::pi / 180.0;
  const Mat3 variance =
      data.common_error.middleRows<3>(15) * data.common_error.middleRows<3>(15).transpose();
  const Mat3 expected =
      0.09 * Mat3::Identity() +
      turn * turn * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  EXPECT_LT((variance - expected).norm(), 1e-12);
  EXPECT_EQ(built(points_on_cap(100, 8.0)).at(still(surface)).common_error.size(), 0);
}

TEST(SurfaceDistances, RefuseWhatLiesElsewhereOrIsNotFinite) {
  const auto far =
      SurfaceDistances::build(cap(), points_on_cap(100, 8.0).colwise() + Vec3(0, 0, 80));
  ASSERT_FALSE(far.has_value());
  EXPECT_EQ(far.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(far.error().message, HasSubstr("0 of 100 points lie over the craniotomy"));
  Points measured = points_on_cap(100, 8.0);
  measured(1, 17) = std::numeric_limits<double>::quiet_NaN();
  const auto not_finite = SurfaceDistances::build(cap(), measured);
  ASSERT_FALSE(not_finite.has_value());
  EXPECT_EQ(not_finite.error().code, ErrorCode::kNotFinite);
  EXPECT_THAT(not_finite.error().message, HasSubstr("point 17"));
  const auto nothing = SurfaceDistances::build(SurfacePatch{}, points_on_cap(100, 8.0));
  ASSERT_FALSE(nothing.has_value());
  EXPECT_EQ(nothing.error().code, ErrorCode::kEmptySet);
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

}  // namespace
}  // namespace brainshift::registration
