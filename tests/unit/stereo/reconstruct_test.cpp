// SPDX-License-Identifier: GPL-3.0-or-later
// From pictures of a known patch to its surface: as near as the disparity's error allows, and
// facing the camera.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/geometry/surface.hpp"
#include "common/geometry/surface_check.hpp"
#include "common/stereo/cleaning.hpp"
#include "common/stereo/reconstruct.hpp"
#include "tests/support/results.hpp"
#include "tests/support/stereo_scene.hpp"

namespace brainshift::stereo {
namespace {

Points grid_with_strays(int strays) {
  Points points(3, 400 + strays);
  for (int i = 0; i < 400; ++i) points.col(i) = Vec3(i % 20, static_cast<double>(i / 20), 0.0);
  for (int s = 0; s < strays; ++s) points.col(400 + s) = Vec3(5.0 * s, 7.0, 15.0 + 6.0 * s);
  return points;
}

TEST(DistanceOutliers, StraysAboveAGridAreFoundAndNothingElse) {
  const std::vector<bool> outlier = distance_outliers(grid_with_strays(3), 3.0);
  for (std::size_t i = 0; i < outlier.size(); ++i) EXPECT_EQ(outlier[i], i >= 400) << i;
}

TEST(DistanceOutliers, FewPointsHaveNone) {
  Points points = Points::Zero(3, 8);
  points(0, 7) = 1000.0;
  const std::vector<bool> outlier = distance_outliers(points, 1.0, 8);
  EXPECT_EQ(std::count(outlier.begin(), outlier.end(), true), 0);
}

// One character per pixel: a digit is a disparity, a dot is no match.
PixelMap<float> map_of(const std::vector<std::string>& rows) {
  PixelMap<float> map(static_cast<int>(rows[0].size()), static_cast<int>(rows.size()),
                      std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) {
      const char pixel = rows[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
      if (pixel != '.') map.at(x, y) = static_cast<float>(pixel - '0');
    }
  return map;
}

std::vector<std::string> rows_of(const PixelMap<float>& map) {
  std::vector<std::string> rows;
  for (int y = 0; y < map.height; ++y) {
    rows.emplace_back();
    for (int x = 0; x < map.width; ++x)
      rows.back() +=
          std::isnan(map.at(x, y)) ? '.' : static_cast<char>('0' + std::lround(map.at(x, y)));
  }
  return rows;
}

// A part of 6 ones, of 4 nines beside it, and of 2 ones that touch the first by a corner only.
const std::vector<std::string> kThreeParts = {"11199",  //
                                              "11199",  //
                                              "...11"};

TEST(Parts, SmallOnesAreDroppedAndCounted) {
  PixelMap<float> map = map_of(kThreeParts);
  const PartSizes sizes = drop_small_parts(map, 1.0, 3);
  EXPECT_EQ(rows_of(map), (std::vector<std::string>{"11199", "11199", "....."}));
  EXPECT_EQ(sizes.left, 10);
  EXPECT_EQ(sizes.dropped, 2);
  EXPECT_EQ(sizes.largest, 6);
}

TEST(Parts, AFractionOfTheLargestIsTheBound) {
  PixelMap<float> map = map_of(kThreeParts);
  // 0.7 of 6 is 4.2: the part of 4 goes too.
  const PartSizes sizes = drop_minor_parts(map, 1.0, 0.7);
  EXPECT_EQ(rows_of(map), (std::vector<std::string>{"111..", "111..", "....."}));
  EXPECT_EQ(sizes.left, 6);
  EXPECT_EQ(sizes.dropped, 6);
}

TEST(Parts, AStepWithinTheBoundConnects) {
  PixelMap<float> map = map_of(kThreeParts);
  EXPECT_EQ(drop_small_parts(map, 8.0, 3).largest, 12) << "ones, nines and, below them, ones";
  EXPECT_EQ(rows_of(map), kThreeParts);
}

TEST(Parts, OfAMapWithoutAMatchAreNone) {
  PixelMap<float> map = map_of({"...", "..."});
  const PartSizes sizes = drop_minor_parts(map, 1.0, 0.5);
  EXPECT_EQ(sizes.left, 0);
  EXPECT_EQ(sizes.dropped, 0);
  EXPECT_EQ(sizes.largest, 0);
}

using test_support::Eye;
using test_support::operating_rig;
using test_support::Patch;
using testing::HasSubstr;

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

RigidTransform some_pose() {
  RigidTransform T = RigidTransform::Identity();
  T.linear() =
      (Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()) * Eigen::AngleAxisd(3.0, Vec3::UnitX()))
          .toRotationMatrix();
  T.translation() = Vec3(20.0, -35.0, 110.0);
  return T;
}

// A map of one disparity, f = 1000 px, b = 30 mm: a plane at 250 mm.
const RectifiedGeometry kGeometry{1000.0, 100.0, 100.0, 80.0, 30.0, Mat3::Identity()};
DisparityMap plane(float disparity = 120.0F) {
  return {{200, 160, disparity}, {200, 160, 0.25F}, 1.0};
}

struct Errors {
  double rms_mm = 0.0;       // across the patch's surface
  double within_2_sd = 0.0;  // fraction of vertices whose error in depth is below twice their sd
};

Errors errors_of(const ReconstructedSurface& result, const Patch& patch,
                 const RigidTransform& T_ras_camera) {
  Errors errors;
  const Eigen::Index n = result.surface.vertices.cols();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec3 x = T_ras_camera.inverse() * Vec3(result.surface.vertices.col(i));
    const double depth_error = x.z() - test_support::patch_depth(patch, x.x(), x.y());
    const Vec3 normal = test_support::patch_normal(patch, x.x(), x.y());
    errors.rms_mm += std::pow(depth_error * normal.z(), 2) / static_cast<double>(n);
    if (std::abs(depth_error) <= 2.0 * result.sd_mm[i])
      errors.within_2_sd += 1.0 / static_cast<double>(n);
  }
  errors.rms_mm = std::sqrt(errors.rms_mm);
  return errors;
}

TEST(Reconstruct, APatchIsFoundAsWellAsItsDisparityAllows) {
  const StereoCalibration rig = operating_rig();
  const Patch patch;
  const auto measured = value_or_fail(measure_disparity(
      render(rig, Eye::kLeft, patch, 1), render(rig, Eye::kRight, patch, 2), rig, {150.0, 400.0}));
  EXPECT_GT(measured.map.valid_fraction, 0.6);
  const auto result = value_or_fail(reconstruct(measured.map, measured.geometry, some_pose()));
  const Errors errors = errors_of(result, patch, some_pose());
  EXPECT_GT(result.surface.num_vertices(), 5000);
  // Z^2 / (f b) is 1.9 mm per px here.
  // The error may be as large as the stated sd. It is smaller, because kFloor_px holds errors of
  // real light and a vertex averages a block's pixels; below a quarter the sd would say nothing.
  EXPECT_LT(errors.rms_mm, result.median_sd_mm);
  EXPECT_GT(errors.rms_mm, 0.25 * result.median_sd_mm);
  EXPECT_GT(errors.within_2_sd, 0.95);
  // The cap falls away by 50 mm towards the corners.
  EXPECT_GT(result.median_depth_mm, 250.0);
  EXPECT_LT(result.median_depth_mm, 290.0);
}

TEST(Reconstruct, NormalsLookTowardsTheCamera) {
  const auto result = value_or_fail(reconstruct(plane(), kGeometry, some_pose()));
  const Points normals = geometry::vertex_normals(result.surface);
  const Vec3 camera = some_pose().translation();
  for (Eigen::Index i = 0; i < normals.cols(); ++i)
    EXPECT_GT(normals.col(i).dot(camera - result.surface.vertices.col(i)), 200.0);
  const auto rims = value_or_fail(geometry::surface_rims(result.surface));
  EXPECT_EQ(rims.parts, 1);
  EXPECT_EQ(rims.rim_mm.size(), 1U);
}

TEST(Reconstruct, APlaneHasItsDepthSpacingAndStandardDeviation) {
  ReconstructOptions options;
  options.spacing_mm = 1.0;  // 4 px at 250 mm
  const auto result =
      value_or_fail(reconstruct(plane(), kGeometry, RigidTransform::Identity(), options));
  EXPECT_EQ(result.surface.num_vertices(), 50 * 40);
  EXPECT_EQ(result.surface.num_triangles(), 2 * 49 * 39);
  for (const double z : result.surface.vertices.row(2)) EXPECT_NEAR(z, 250.0, 1e-6);
  EXPECT_NEAR(result.sd_mm.maxCoeff(), 250.0 * 250.0 / 30000.0 * 0.25, 1e-6);
  EXPECT_NEAR(result.confidence.minCoeff(), confidence(0.25), 1e-6);
  // The first block's four columns have their mean at 1.5 px.
  EXPECT_NEAR(result.surface.vertices(0, 0), (1.5 - 100.0) * 250.0 / 1000.0, 1e-9);
  EXPECT_NEAR(result.surface.vertices(1, 0), (1.5 - 80.0) * 250.0 / 1000.0, 1e-9);
  options.max_points = 500;
  EXPECT_LE(
      reconstruct(plane(), kGeometry, RigidTransform::Identity(), options)->surface.num_vertices(),
      500);
}

TEST(Reconstruct, SpecksAndStepsAreNotBridged) {
  DisparityMap map = plane();
  for (int y = 0; y < 160; ++y)
    for (int x = 100; x < 200; ++x) map.disparity_px.at(x, y) = 150.0F;  // 200 mm: a step of 50 mm
  for (int y = 20; y < 30; ++y)
    for (int x = 20; x < 30; ++x) map.disparity_px.at(x, y) = 170.0F;  // a speck of 100 px
  const auto result = value_or_fail(reconstruct(map, kGeometry, RigidTransform::Identity()));
  EXPECT_EQ(result.pixels_in_small_parts, 100);
  const auto rims = value_or_fail(geometry::surface_rims(result.surface));
  EXPECT_EQ(rims.parts, 2) << "the step's two sides";
  EXPECT_EQ(rims.rim_mm.size(), 3U) << "and the hole that the speck leaves";
  for (const double z : result.surface.vertices.row(2))
    EXPECT_TRUE(std::abs(z - 250.0) < 1.0 || std::abs(z - 200.0) < 1.0) << z;
}

TEST(Reconstruct, BadPosesOptionsAndMapsAreRefused) {
  const auto refusal = [](const DisparityMap& map, const RigidTransform& T,
                          const ReconstructOptions& options = {}) {
    const auto result = reconstruct(map, kGeometry, T, options);
    return result ? "no refusal" : result.error().message;
  };
  RigidTransform skewed = some_pose();
  skewed.linear()(0, 1) += 0.05;
  EXPECT_THAT(refusal(plane(), skewed), HasSubstr("T_ras_camera is no rigid motion"));
  ReconstructOptions options;
  options.spacing_mm = 0.0;
  EXPECT_EQ(refusal(plane(), some_pose(), options), "spacing_mm = 0: must be finite and > 0");
  options = {};
  options.max_points = 10;
  EXPECT_EQ(refusal(plane(), some_pose(), options), "max_points = 10: must be at least 50");
  EXPECT_EQ(refusal(plane(kNone), some_pose()), "the surface has 0 points: must be at least 50");
  EXPECT_EQ(refusal(plane(-5.0F), some_pose()), "the surface has 0 points: must be at least 50")
      << "beyond infinity";
}

}  // namespace
}  // namespace brainshift::stereo
