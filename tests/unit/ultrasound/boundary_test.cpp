// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/ultrasound/boundary.hpp"
#include "tests/support/results.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace brainshift::ultrasound {
namespace {

using testing::HasSubstr;

AffineTransform pixels(double u_mm, double v_mm) {
  AffineTransform T = AffineTransform::Identity();
  T.linear() = Eigen::AngleAxisd(0.7, Vec3(1, 1, 2).normalized()).toRotationMatrix() *
               Eigen::Scaling(u_mm, v_mm, 1.0);
  T.translation() = Vec3(10, 20, 30);
  return T;
}

Contour circle(int corners, double radius_px) {
  Contour contour;
  contour.frame = 4;
  contour.points_px.resize(2, corners);
  for (int k = 0; k < corners; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / corners;
    contour.points_px.col(k) << 100 + radius_px * std::cos(angle), 80 + radius_px * std::sin(angle);
  }
  return contour;
}

TEST(BoundaryPoints, AreEquallySpacedAlongAClosedContour) {
  const auto points = value_or_fail(boundary_points(circle(1000, 50), pixels(0.2, 0.2)));
  // Circumference 2 pi 10 mm = 62.83 mm: 314 steps.
  ASSERT_EQ(points.cols(), 314);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vec3 next = points.col((i + 1) % points.cols());
    EXPECT_NEAR((next - points.col(i)).norm(), 0.2, 1e-3);
    EXPECT_NEAR((points.col(i) - pixels(0.2, 0.2) * Vec3(100, 80, 0)).norm(), 10.0, 1e-3);
  }
}

TEST(BoundaryPoints, DoNotDependOnHowDenselyAContourWasClicked) {
  // Corners that lie unevenly on a square; the resampled points are the same.
  Contour coarse, fine;
  coarse.points_px.resize(2, 4);
  coarse.points_px << 0, 40, 40, 0, 0, 0, 40, 40;
  fine.points_px.resize(2, 6);
  fine.points_px << 0, 1, 3.5, 40, 40, 0, 0, 0, 0, 0, 40, 40;
  const auto a = value_or_fail(boundary_points(coarse, pixels(0.3, 0.1)));
  const auto b = value_or_fail(boundary_points(fine, pixels(0.3, 0.1)));
  ASSERT_EQ(a.cols(), b.cols());
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(BoundaryPoints, OfAnOpenContourKeepBothEnds) {
  Contour line;
  line.closed = false;
  line.points_px.resize(2, 2);
  line.points_px << 0, 10, 0, 0;
  const auto points = value_or_fail(boundary_points(line, pixels(0.1, 0.1)));
  ASSERT_EQ(points.cols(), 6);  // 1 mm in steps of 0.2
  EXPECT_LT((points.col(0) - pixels(0.1, 0.1) * Vec3(0, 0, 0)).norm(), 1e-12);
  EXPECT_LT((points.col(5) - pixels(0.1, 0.1) * Vec3(10, 0, 0)).norm(), 1e-12);
}

void expect_boundary_refused(const Contour& contour, double spacing_mm, const std::string& says) {
  EXPECT_THAT(sentence_of(boundary_points(contour, pixels(0.2, 0.2), spacing_mm)), HasSubstr(says));
}

TEST(BoundaryPoints, RefuseWhatIsNoContourNamingTheFrame) {
  expect_boundary_refused(circle(2, 50), 0.2, "frame 4 has 2 points: must have at least 3");
  Contour dot = circle(5, 0.0);
  expect_boundary_refused(dot, 0.2, "frame 4 is 0 mm long");
  Contour infinite = circle(5, 10.0);
  infinite.points_px(1, 2) = std::numeric_limits<double>::quiet_NaN();
  expect_boundary_refused(infinite, 0.2, "frame 4 holds a value that is not a finite number");
  expect_boundary_refused(circle(50, 50), 0.0, "spacing = 0 mm");
  expect_boundary_refused(circle(50, 1e9), 0.2, "frame 4");
}

}  // namespace
}  // namespace brainshift::ultrasound
