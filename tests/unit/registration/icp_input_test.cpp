// SPDX-License-Identifier: GPL-3.0-or-later
// The input that align() rejects, and its messages.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "common/geometry/surface.hpp"
#include "common/registration/icp.hpp"

namespace brainshift::registration {
namespace {

TriangleSurface input_ellipsoid() {
  return geometry::ellipsoid_surface(Vec3(35, -45, 20), Vec3(18, 13, 9), 3.0);
}

void expect_refused(const Points& points, const RigidTransform& T, const IcpOptions& options,
                    ErrorCode code, const std::string& naming) {
  const auto surface = geometry::ClosestPointIndex::build(input_ellipsoid());
  ASSERT_TRUE(surface);
  const auto result = align(points, *surface, T, options);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, code);
  EXPECT_NE(result.error().message.find(naming), std::string::npos) << result.error().message;
  EXPECT_EQ(result.error().message.find('\n'), std::string::npos);
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
