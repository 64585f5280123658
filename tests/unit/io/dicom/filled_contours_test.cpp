// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/dicom/filled_contours.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include "tests/support/results.hpp"

namespace brainshift::io {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

// Corners about a centre in the plane S = centre.z(); counter-clockwise.
Points polygon(const Vec3& centre, double radius, int corners) {
  Points points(3, corners);
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * std::numbers::pi * (i + 0.5) / corners;
    points.col(i) = centre + radius * Vec3(std::cos(angle), std::sin(angle), 0.0);
  }
  return points;
}
// Side length 2 half.
Points square(const Vec3& centre, double half) { return polygon(centre, half * std::sqrt(2.0), 4); }

VoxelImage grid(double step_mm, const Mat3& axes = Mat3::Identity()) {
  VoxelImage image;
  const int along = static_cast<int>(60.0 / step_mm) + 1;
  image.dims = {along, along, along};
  image.T_ras_voxel.linear() = step_mm * axes;
  image.T_ras_voxel.translation() = -axes * Vec3::Constant(30.0);
  return image;
}

double filled_mm3(const FilledContours& filled) {
  const auto count = std::count(filled.mask.values.begin(), filled.mask.values.end(), 1.0F);
  return static_cast<double>(count) * std::abs(filled.mask.T_ras_voxel.linear().determinant());
}

FilledContours fill(const std::vector<Points>& contours, const VoxelImage& on) {
  return value_or_fail(fill_contours(contours, on));
}
std::string refusal(const std::vector<Points>& contours) {
  return refusal_of(fill_contours(contours, grid(1.0)), ErrorCode::kInvalidArgument);
}

TEST(FilledContours, AVoxelIsInsideWhereItsCentreIs) {
  const auto filled =
      fill({square(Vec3(0.5, 0.5, 4), 3.0), square(Vec3(0.5, 0.5, 5), 3.0)}, grid(1.0));
  EXPECT_EQ(filled_mm3(filled), 72.0);
  EXPECT_EQ(filled.mask.at(28, 28, 34), 1.0F);  // (-2, -2, 4)
  EXPECT_EQ(filled.mask.at(27, 28, 34), 0.0F);
  EXPECT_EQ(filled.mask.at(33, 33, 35), 1.0F);
  EXPECT_THAT(filled.notes, IsEmpty());
}

TEST(FilledContours, AContourWithinAnotherIsAHoleAndOneWithinThatIsNot) {
  const std::vector<Points> nested = {
      square(Vec3(0.5, 0.5, 0), 9.0), square(Vec3(0.5, 0.5, 0), 6.0),
      square(Vec3(0.5, 0.5, 0), 3.0), square(Vec3(20.5, 0.5, 0), 2.0)};
  const double expected = 18.0 * 18.0 - 12.0 * 12.0 + 6.0 * 6.0 + 4.0 * 4.0;
  EXPECT_EQ(filled_mm3(fill(nested, grid(1.0))), expected);
  EXPECT_NEAR(value_or_fail(contours_volume_mm3(nested, grid(1.0))), expected, 1e-6);
}

// Programs that follow pixels draw contours through the centres of the outermost ones.
TEST(FilledContours, WhatLiesOnAContourIsInside) {
  EXPECT_EQ(filled_mm3(fill({square(Vec3(0, 0, 0), 3.0)}, grid(1.0))), 49.0);
  EXPECT_EQ(filled_mm3(fill({square(Vec3(0, 0, 0), 5.0), square(Vec3(0, 0, 0), 3.0)}, grid(1.0))),
            121.0 - 25.0);
}

// A ball drawn in planes that are turned and shifted against the grid, on a grid of another step.
TEST(FilledContours, NeitherDirectionNorSliceOfTheGridCounts) {
  constexpr double kRadius = 16.0, kStep = 0.5;
  std::vector<Points> ball;
  double drawn = 0.0;
  for (double s = -kRadius + 0.5 * kStep; s < kRadius; s += kStep) {
    ball.push_back(polygon(Vec3(1.3, -2.2, s + 0.13), std::sqrt(kRadius * kRadius - s * s), 180));
    drawn += 90.0 * std::sin(2.0 * std::numbers::pi / 180.0) * (kRadius * kRadius - s * s) * kStep;
  }
  EXPECT_NEAR(value_or_fail(contours_volume_mm3(ball, grid(1.0))), drawn, 1e-6 * drawn);
  const Mat3 turned = Eigen::AngleAxisd(0.6, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const auto filled = fill(ball, grid(0.8, turned));
  EXPECT_NEAR(filled_mm3(filled), drawn, 0.01 * drawn);
  EXPECT_THAT(filled.notes,
              Contains(HasSubstr("turned by 20 degrees")));  // acos(cos 0.6 + 9/14 (1 - cos 0.6))
  std::size_t v = 0;
  for (int k = 0; k < filled.mask.dims[2]; ++k)
    for (int j = 0; j < filled.mask.dims[1]; ++j)
      for (int i = 0; i < filled.mask.dims[0]; ++i, ++v) {
        const double away =
            (filled.mask.T_ras_voxel * Vec3(i, j, k) - Vec3(1.3, -2.2, 0.13)).norm();
        if (std::abs(away - kRadius) > 0.5) {
          ASSERT_EQ(filled.mask.values[v] > 0.0F, away < kRadius) << away;
        }
      }
  EXPECT_THAT(fill(ball, grid(2.0)).notes, Contains(HasSubstr("beside the image's slices")));
}

TEST(FilledContours, AGapStaysEmptyAndIsTold) {
  std::vector<Points> two;
  for (const double s : {-10.0, -8.0, -6.0, 6.0, 8.0})
    two.push_back(square(Vec3(0.5, 0.5, s), 3.0));
  const auto filled = fill(two, grid(1.0));
  EXPECT_EQ(filled.spacing_mm, 2.0);
  EXPECT_EQ(filled_mm3(filled), 36.0 * 10.0);
  EXPECT_THAT(filled.notes, Contains(HasSubstr("a gap between its planes, up to 12.0 mm wide where "
                                               "2.0 mm are usual")));
}

TEST(FilledContours, AContourOfFewerThanThreePointsIsNone) {
  const auto filled =
      fill({Points(3, 0), square(Vec3(0.5, 0.5, 4), 3.0), Points::Ones(3, 2)}, grid(1.0));
  EXPECT_EQ(filled_mm3(filled), 36.0);
}

TEST(FilledContours, WhatIsWrongIsNamed) {
  Points bent = square(Vec3(0, 0, 0), 5.0);
  bent(2, 1) += 0.9;
  EXPECT_THAT(refusal({square(Vec3(0, 0, 2), 9.0), bent}),
              AllOf(HasSubstr("contour 2 does not lie in a plane"), HasSubstr("mm out of it")));
  const Mat3 turn = Eigen::AngleAxisd(0.3, Vec3::UnitX()).toRotationMatrix();
  EXPECT_THAT(refusal({square(Vec3(0, 0, 2), 9.0), turn * square(Vec3(0, 0, 0), 5.0)}),
              HasSubstr("contour 2 does not lie in a plane parallel to the others"));
  EXPECT_THAT(refusal({square(Vec3(0, 0, 0), 5.0), square(Vec3(4, 4, 0), 5.0)}),
              HasSubstr("contours 1 and 2 lie in one plane and cross"));
  EXPECT_THAT(
      refusal({square(Vec3(0, 0, 0), 5.0), square(Vec3(0, 0, 1), 5.0), square(Vec3(0, 0, 0), 5.0)}),
      HasSubstr("contours 1 and 3 are the same"));
  EXPECT_THAT(refusal({polygon(Vec3(0, 0, 0), 12.0, 90), polygon(Vec3(0, 0, 0), 11.95, 61)}),
              HasSubstr("contours 1 and 2 are the same"));
  EXPECT_THAT(refusal({square(Vec3(40, 0, 0), 5.0)}),
              AllOf(HasSubstr("100 % of its points"), HasSubstr("another series")));
  EXPECT_THAT(refusal({square(Vec3(0.5, 0.5, 0), 0.2)}), HasSubstr("no voxel"));
  EXPECT_THAT(refusal({Points(square(Vec3(0, 0, 0), 5.0).leftCols(2))}),
              HasSubstr("no contour that encloses an area"));
  EXPECT_THAT(refusal({}), HasSubstr("no contour"));
}

}  // namespace
}  // namespace brainshift::io
