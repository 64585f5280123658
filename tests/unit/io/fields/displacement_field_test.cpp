// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/fields/displacement_field.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <limits>

#include "tests/support/refusals.hpp"
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
    return refusal_of(validate(grid), code);
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

TEST(DisplacementField, DirectionsAreTwoWordsAndNothingElse) {
  EXPECT_EQ(field_direction("resampling"), FieldDirection::kResampling);
  EXPECT_EQ(field_direction("modeling"), FieldDirection::kModeling);
  for (const char* word : {"", "modelling", "Resampling", "both", "resampling "}) {
    EXPECT_FALSE(field_direction(word)) << word;
  }
}

TEST(DisplacementField, AGoodOneIsValid) {
  EXPECT_TRUE(validate(small_field()));
  EXPECT_TRUE(validate(small_volume()));
}

TEST(DisplacementField, AMissingValueIsNamed) {
  DisplacementField field = small_field();
  field.ras_mm.pop_back();
  EXPECT_THAT(validate(field).error().message, HasSubstr("179 values: must have 3 for each of 60"));
  ScalarVolume volume = small_volume();
  volume.values.push_back(1.0F);
  EXPECT_THAT(validate(volume).error().message, HasSubstr("61 values: must have 1 for each of 60"));
}

TEST(DisplacementField, AValueThatIsNotFiniteIsNamedByItsVoxel) {
  DisplacementField field = small_field();
  field.ras_mm[3 * field.grid.index(4, 2, 1) + 1] = std::numeric_limits<float>::infinity();
  EXPECT_THAT(refusal_of(validate(field), ErrorCode::kNotFinite),
              HasSubstr("voxel (4, 2, 1) is not finite"));
  ScalarVolume volume = small_volume();
  volume.values[volume.grid.index(0, 3, 2)] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(validate(volume).error().message, HasSubstr("voxel (0, 3, 2) is not finite"));
}

TEST(DisplacementField, ANoteThatFilesCannotHoldIsRefused) {
  DisplacementField field = small_field();
  field.note = std::string(57, 'a');
  EXPECT_THAT(validate(field).error().message, HasSubstr("57 characters"));
  field.note = "two\nlines";
  EXPECT_FALSE(validate(field));
  field.note = "";
  EXPECT_TRUE(validate(field));
}

TEST(DisplacementField, AnInvalidGridComesFirst) {
  DisplacementField field = small_field();
  field.grid.dims[0] = 0;
  EXPECT_THAT(validate(field).error().message, HasSubstr("0 x 4 x 3"));
}

}  // namespace
}  // namespace brainshift::io
