// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/oriented_cloud.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "common/core/random.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::geometry {
namespace {

const Vec3 kCloudCentre(35, -45, 20);

Points sphere(int count, double radius) {
  Random random(2);
  Points points(3, count);
  for (int i = 0; i < count; ++i) points.col(i) = kCloudCentre + radius * random.direction();
  return points;
}

TEST(OrientedCloud, FindsTheClosestPoint) {
  const Points points = sphere(500, 20);
  const auto cloud = OrientedCloud::build(points);
  ASSERT_TRUE(cloud);
  Random random(3);
  for (int repetition = 0; repetition < 200; ++repetition) {
    const Vec3 x = kCloudCentre + 30.0 * random.uniform() * random.direction();
    Eigen::Index expected = 0;
    const double least = (points.colwise() - x).colwise().norm().minCoeff(&expected);
    double distance = 0.0;
    EXPECT_EQ(cloud->closest(x, distance), expected);
    EXPECT_NEAR(distance, least, 1e-12);
  }
}

TEST(OrientedCloud, EstimatedNormalsOfASphereAreRadial) {
  CloudOptions options;
  options.seen_from_mm = kCloudCentre;
  const Points points = sphere(4000, 20);
  const auto cloud = OrientedCloud::build(points, Points(3, 0), options);
  ASSERT_TRUE(cloud);
  double sum = 0.0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vec3 inwards = (kCloudCentre - points.col(i)).normalized();
    EXPECT_NEAR(cloud->normals().col(i).norm(), 1.0, 1e-9);
    EXPECT_GT(cloud->normals().col(i).dot(inwards), 0.95);
    sum += cloud->normals().col(i).dot(inwards);
  }
  EXPECT_GT(sum / 4000, 0.998);
}

TEST(OrientedCloud, IsAPlaneWithinReachAndAPointBeyond) {
  Points points(3, 121);
  for (int i = 0; i < 121; ++i) points.col(i) = Vec3(i % 11 - 5, i / 11 - 5, 0.0);
  CloudOptions options;
  options.reach_mm = 3.0;
  options.seen_from_mm = Vec3(0, 0, 100);
  const auto cloud = OrientedCloud::build(points, Points(3, 0), options);
  ASSERT_TRUE(cloud);
  const DistanceSample above = cloud->at(Vec3(0.3, 0.4, 2.0));
  EXPECT_NEAR(above.distance_mm, 2.0, 1e-9);
  EXPECT_LT((above.gradient - Vec3::UnitZ()).norm(), 1e-9);
  EXPECT_NEAR(cloud->at(Vec3(0.3, 0.4, -2.0)).distance_mm, -2.0, 1e-9);
  // Beside the patch: in its plane, yet not on the surface.
  const DistanceSample beside = cloud->at(Vec3(15, 0, 0));
  EXPECT_NEAR(beside.distance_mm, 10.0, 1e-9);
  EXPECT_LT((beside.gradient - Vec3::UnitX()).norm(), 1e-9);
  EXPECT_EQ(cloud->at(Vec3(2, 3, 0)).distance_mm, 0.0);
}

TEST(OrientedCloud, NormalsOfEitherSignMakeTheSamePlane) {
  Points points(3, 121), normals(3, 121);
  for (int i = 0; i < 121; ++i) {
    points.col(i) = Vec3(i % 11 - 5, i / 11 - 5, 0.0);
    normals.col(i) = (i % 2 == 0 ? 1.0 : -1.0) * Vec3::UnitZ();
  }
  const auto cloud = OrientedCloud::build(points, normals);
  ASSERT_TRUE(cloud);
  for (const double x : {0.1, 0.4, 0.6, 0.9}) {
    const DistanceSample sample = cloud->at(Vec3(x, 0.2, 1.5));
    EXPECT_NEAR(std::abs(sample.distance_mm), 1.5, 1e-12);
    EXPECT_NEAR(std::abs(sample.gradient.z()), 1.0, 1e-12);
  }
}

// Points with 0.1 mm of noise: the distance to the plane of the closest point jumps from point to
// point; the blended distance jumps less.
TEST(OrientedCloud, DistanceHardlyJumpsWhereTheClosestPointChanges) {
  Points points = sphere(2000, 20);
  Random noise(8);
  for (auto x : points.colwise()) x += 0.1 * noise.normal() * (x - kCloudCentre).normalized();
  const auto cloud = OrientedCloud::build(points, points.colwise() - kCloudCentre);
  ASSERT_TRUE(cloud);
  Random random(9);
  double blended = 0.0, single = 0.0;
  for (int repetition = 0; repetition < 2000; ++repetition) {
    const Vec3 x = kCloudCentre + 21.0 * random.direction();
    const Vec3 beside =
        kCloudCentre + 21.0 * (x - kCloudCentre + 0.05 * random.direction()).normalized();
    double distance = 0.0;
    const int a = cloud->closest(x, distance), b = cloud->closest(beside, distance);
    if (a == b) continue;
    const auto plane = [&](int id, const Vec3& at) {
      return Vec3(cloud->normals().col(id)).dot(at - points.col(id));
    };
    blended = std::max(blended, std::abs(cloud->at(x).distance_mm - cloud->at(beside).distance_mm));
    single = std::max(single, std::abs(plane(a, x) - plane(b, beside)));
  }
  EXPECT_GT(single, 0.2);
  EXPECT_LT(blended, 0.5 * single);
}

TEST(OrientedCloud, DefaultReachIsFiveSpacings) {
  Points points(3, 121);
  for (int i = 0; i < 121; ++i) points.col(i) = 0.7 * Vec3(i % 11, i / 11, 0.0);
  const auto cloud = OrientedCloud::build(points);
  ASSERT_TRUE(cloud);
  EXPECT_NEAR(cloud->reach_mm(), 3.5, 1e-9);
}

TEST(OrientedCloud, GivenNormalsAreScaledToUnitLength) {
  const Points points = sphere(50, 20);
  const auto cloud = OrientedCloud::build(points, 3.0 * (points.colwise() - kCloudCentre));
  ASSERT_TRUE(cloud);
  EXPECT_LT((cloud->normals() - (points.colwise() - kCloudCentre) / 20.0).norm(), 1e-9);
}

// Lines 5 mm apart with a point every 0.1 mm: all neighbours are on the same line.
TEST(OrientedCloud, PointsOfASingleLineHaveNoPlane) {
  Points points(3, 300);
  for (int i = 0; i < 300; ++i) points.col(i) = Vec3(0.1 * (i % 100), 5.0 * (i / 100), 0.0);
  const auto refused = OrientedCloud::build(points);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kEmptySet);
  EXPECT_NE(refused.error().message.find("lie on lines"), std::string::npos);
  // One neighbourhood that is a plane, and the rest counts as points.
  Points more(3, 304);
  more << points, Vec3(100, 0, 0), Vec3(101, 0, 0), Vec3(100, 1, 0), Vec3(101, 1, 0);
  CloudOptions options;
  options.neighbours = 3;
  const auto cloud = OrientedCloud::build(more, Points(3, 0), options);
  ASSERT_TRUE(cloud);
  EXPECT_NEAR(cloud->at(Vec3(5.03, 5.0, 0.3)).distance_mm, std::hypot(0.03, 0.3), 1e-9);
  EXPECT_NEAR(std::abs(cloud->at(Vec3(100.1, 0.1, 0.3)).distance_mm), 0.3, 1e-9);
}

TEST(OrientedCloud, RejectsAnInvalidCloud) {
  const auto refused = [](const Points& points, const Points& normals, const CloudOptions& options,
                          ErrorCode code, const std::string& naming) {
    const auto cloud = OrientedCloud::build(points, normals, options);
    ASSERT_FALSE(cloud);
    EXPECT_EQ(cloud.error().code, code);
    EXPECT_NE(cloud.error().message.find(naming), std::string::npos) << cloud.error().message;
  };
  const Points none(3, 0);
  Points points = sphere(20, 10);
  refused(points.leftCols(2), none, {}, ErrorCode::kEmptySet, "2 points");
  refused(points, points.leftCols(7), {}, ErrorCode::kInvalidArgument, "7 normals for 20");
  Points normals = points;
  normals.col(4).setZero();
  refused(points, normals, {}, ErrorCode::kInvalidArgument, "normal 4 has no length");
  normals(0, 6) = std::nan("");
  normals.col(4).setOnes();
  refused(points, normals, {}, ErrorCode::kNotFinite, "normal 6");
  CloudOptions options;
  options.neighbours = 2;
  refused(points, none, options, ErrorCode::kInvalidArgument, "neighbours = 2");
  options = {};
  options.reach_mm = -1;
  refused(points, none, options, ErrorCode::kInvalidArgument, "reach_mm = -1");
  points(2, 9) = std::nan("");
  refused(points, none, {}, ErrorCode::kNotFinite, "point 9");
}

}  // namespace
}  // namespace brainshift::geometry
