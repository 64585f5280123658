// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/fields/displacement_field.hpp"

#include <gmock/gmock.h>

#include <limits>

#include "tests/unit/io/fields/small_field.hpp"

namespace brainshift::io {
namespace {

using testing::HasSubstr;

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
  EXPECT_EQ(validate(field).error().code, ErrorCode::kNotFinite);
  EXPECT_THAT(validate(field).error().message, HasSubstr("voxel (4, 2, 1) is not finite"));
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
