// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/fields/voxel_grid.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <limits>

#include "tests/unit/io/fields/small_field.hpp"

namespace brainshift::io {
namespace {

using testing::HasSubstr;

TEST(VoxelGrid, AnObliqueFlippedGridIsTakenApartAndPutTogether) {
  const VoxelGrid grid = oblique_grid();
  ASSERT_TRUE(validate(grid));
  EXPECT_TRUE(grid.spacing_mm().isApprox(Vec3(1.0, 1.5, 2.5), 1e-14));
  EXPECT_NEAR(grid.directions().determinant(), -1.0, 1e-14);
  EXPECT_TRUE((grid.directions().transpose() * grid.directions()).isIdentity(1e-14));
  EXPECT_TRUE(grid.voxel_mm(2, 1, 0).isApprox(
      Vec3(-12.5, 30.25, 7.0) + grid.directions() * Vec3(2.0, 1.5, 0.0), 1e-14));
  EXPECT_EQ(grid.index(4, 3, 2), grid.num_voxels() - 1);
}

TEST(VoxelGrid, SinglePrecisionHeadersAreRightAngled) {
  VoxelGrid grid = oblique_grid();
  grid.T_ras_voxel.matrix() = grid.T_ras_voxel.matrix().cast<float>().cast<double>();
  EXPECT_TRUE(validate(grid));
}

TEST(VoxelGrid, WhatNoFileCanHoldIsRefusedWithItsReason) {
  const auto refusal = [](ErrorCode code, const std::function<void(VoxelGrid&)>& spoil) {
    VoxelGrid grid = oblique_grid();
    spoil(grid);
    const Status status = validate(grid);
    EXPECT_FALSE(status);
    if (status) return std::string();
    EXPECT_EQ(status.error().code, code);
    return status.error().message;
  };
  const auto kBad = ErrorCode::kInvalidArgument;
  EXPECT_THAT(refusal(kBad, [](VoxelGrid& g) { g.dims[1] = 0; }), HasSubstr("5 x 0 x 3"));
  EXPECT_THAT(refusal(kBad, [](VoxelGrid& g) { g.dims[2] = -1; }), HasSubstr("at least 1"));
  EXPECT_THAT(refusal(kBad, [](VoxelGrid& g) { g.dims[0] = 32768; }), HasSubstr("at most 32767"));
  EXPECT_THAT(refusal(kBad,
                      [](VoxelGrid& g) {
                        g.dims = {1024, 1024, 65};
                      }),
              HasSubstr("at most 67108864 voxels"));
  EXPECT_THAT(refusal(kBad,
                      [](VoxelGrid& g) {
                        g.dims = {32767, 32767, 32767};
                      }),
              HasSubstr("voxels in all"));
  EXPECT_THAT(refusal(kBad, [](VoxelGrid& g) { g.T_ras_voxel.linear().col(1).setZero(); }),
              HasSubstr("no length"));
  EXPECT_THAT(refusal(kBad,
                      [](VoxelGrid& g) {
                        g.T_ras_voxel.linear().col(1) += 0.01 * g.T_ras_voxel.linear().col(2);
                      }),
              HasSubstr("voxel axes 2 and 3 are 0.95"));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(
        refusal(ErrorCode::kNotFinite, [&](VoxelGrid& g) { g.T_ras_voxel.translation()[2] = bad; }),
        HasSubstr("not finite"));
  }
}

TEST(VoxelGrid, TheLargestGridIsAllowed) {
  VoxelGrid grid = oblique_grid();
  grid.dims = {1024, 1024, 64};
  EXPECT_TRUE(validate(grid));
}

}  // namespace
}  // namespace brainshift::io
