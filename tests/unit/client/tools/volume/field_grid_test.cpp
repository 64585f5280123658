// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "client/tools/volume/field_grid.hpp"
#include "tests/support/results.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

Points box_corners(const Vec3& low, const Vec3& high) {
  Points points(3, 2);
  points << low, high;
  return points;
}

TEST(FieldGrid, HoldsTheBoxItsMarginAndARimAndNoMore) {
  const FieldGrid grid =
      grid_around(box_corners(Vec3(-30, 0, 5), Vec3(11, 20, 6)), 4.0, 2.0).value();
  // 49, 28 and 9 mm: 25, 14 and 5 steps of 2 mm, a voxel more, and two of the rim.
  EXPECT_EQ(grid.dims, (std::array<int, 3>{28, 17, 8}));
  const Vec3 inner_low = grid.voxel_mm(1, 1, 1);
  const Vec3 inner_high = grid.voxel_mm(26, 15, 6);
  EXPECT_TRUE((inner_low.array() <= Vec3(-34, -4, 1).array()).all());
  EXPECT_TRUE((inner_high.array() >= Vec3(15, 24, 10).array()).all());
  EXPECT_TRUE(((inner_high - inner_low).array() < Vec3(49 + 2, 28 + 2, 9 + 2).array()).all());
  const Vec3 centre = 0.5 * (grid.origin_mm + grid.last_mm());
  EXPECT_TRUE(centre.isApprox(Vec3(-9.5, 10, 5.5), 1e-12));
  EXPECT_TRUE(validate(grid));
}

TEST(FieldGrid, AWholeNumberOfStepsIsNotOneMoreForRounding) {
  const FieldGrid grid =
      grid_around(box_corners(Vec3::Zero(), Vec3(0.3, 0.6, 0.9)), 0.0, 0.1).value();
  EXPECT_EQ(grid.dims, (std::array<int, 3>{6, 9, 12}));
}

TEST(FieldGrid, APointAloneHasARimAroundIt) {
  const FieldGrid grid = grid_around(Points::Constant(3, 1, 7.0), 0.0, 1.0).value();
  EXPECT_EQ(grid.dims, (std::array<int, 3>{3, 3, 3}));
  EXPECT_TRUE(grid.voxel_mm(1, 1, 1).isApprox(Vec3::Constant(7.0)));
}

TEST(FieldGrid, CountsXFastest) {
  const FieldGrid grid{{4, 5, 6}, Vec3::Zero(), 1.0};
  EXPECT_EQ(grid.index(1, 0, 0), 1u);
  EXPECT_EQ(grid.index(0, 1, 0), 4u);
  EXPECT_EQ(grid.index(3, 4, 5), grid.num_voxels() - 1);
}

TEST(FieldGrid, RefusesWhatNoGridCanHold) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuse = [](const Points& points, double margin_mm, double spacing_mm, ErrorCode code,
                         const char* says) {
    EXPECT_THAT(refusal_of(grid_around(points, margin_mm, spacing_mm), code), HasSubstr(says));
  };
  const Points head = box_corners(Vec3::Zero(), Vec3::Constant(200));
  refuse(Points(3, 0), 1, 1, ErrorCode::kEmptySet, "no point");
  refuse(Points::Constant(3, 1, nan), 1, 1, ErrorCode::kNotFinite, "not finite");
  for (const double spacing_mm : {0.0, -1.0, 0.05, 200.0, nan}) {
    refuse(head, 1, spacing_mm, ErrorCode::kInvalidArgument, "must be in [0.1, 100]");
  }
  for (const double margin_mm : {-1.0, 1001.0, nan}) {
    refuse(head, margin_mm, 1, ErrorCode::kInvalidArgument, "must be in [0, 1000]");
  }
  refuse(head, 0, 0.1, ErrorCode::kInvalidArgument, "0.1 mm apart: must have at most 134217728");
  refuse(box_corners(Vec3::Zero(), Vec3(7000, 1, 1)), 0, 0.1, ErrorCode::kInvalidArgument,
         "must be at most 65535");
}

TEST(FieldGrid, ValidateNamesWhatIsWrong) {
  const FieldGrid good{{3, 4, 5}, Vec3::Zero(), 1.0};
  EXPECT_TRUE(validate(good));
  FieldGrid bad = good;
  bad.dims[1] = 2;
  EXPECT_THAT(validate(bad).error().message, HasSubstr("3 x 2 x 5"));
  bad = good;
  bad.spacing_mm = 0.0;
  EXPECT_EQ(validate(bad).error().code, ErrorCode::kInvalidArgument);
  bad = good;
  bad.origin_mm[2] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(validate(bad).error().code, ErrorCode::kNotFinite);
}

TEST(OutsideTaper, IsOneThenACosineThenZero) {
  const OutsideTaper taper;
  EXPECT_EQ(taper.factor(0.0), 1.0);
  EXPECT_EQ(taper.factor(5.0), 1.0);
  EXPECT_NEAR(taper.factor(8.75), 0.8535533905932737, 1e-15);  // (1 + cos 45 degrees) / 2
  EXPECT_NEAR(taper.factor(12.5), 0.5, 1e-15);
  EXPECT_EQ(taper.factor(20.0), 0.0);
  EXPECT_EQ(taper.factor(1e9), 0.0);
}

TEST(OutsideTaper, FallsNowhereFasterThanItsHeaderSays) {
  const OutsideTaper taper;
  double steepest = 0.0;
  for (double d = 0.0; d < 25.0; d += 0.01) {
    const double fall = taper.factor(d) - taper.factor(d + 0.01);
    EXPECT_GE(fall, 0.0);
    steepest = std::max(steepest, fall / 0.01);
  }
  EXPECT_NEAR(steepest, 1.0 / 9.549, 1e-4);
}

TEST(OutsideTaper, RefusesAnOrderThatIsNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(validate(OutsideTaper{}));
  EXPECT_TRUE(validate(OutsideTaper{0.0, 1000.0}));
  for (const OutsideTaper& bad :
       {OutsideTaper{-1, 5}, OutsideTaper{5, 5}, OutsideTaper{6, 5}, OutsideTaper{5, 1001},
        OutsideTaper{nan, 5}, OutsideTaper{5, nan}}) {
    refusal_of(validate(bad), ErrorCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace brainshift::client
