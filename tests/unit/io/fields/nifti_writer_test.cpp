// SPDX-License-Identifier: GPL-3.0-or-later
// Read back by libnifti, and the scalar volume by our own reader, which is tested on its own.
#include "common/io/fields/nifti_writer.hpp"

#include <gmock/gmock.h>
#include <nifti2_io.h>

#include <limits>
#include <memory>

#include "common/io/geometry/image_file.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/fields/small_field.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::StartsWith;

struct FreeImage {
  void operator()(nifti_image* image) const { nifti_image_free(image); }
};
std::unique_ptr<nifti_image, FreeImage> read(const std::filesystem::path& path) {
  std::unique_ptr<nifti_image, FreeImage> image(nifti_image_read(path.c_str(), 1));
  EXPECT_TRUE(image) << path;
  return image;
}

Eigen::Matrix4d matrix_of(const nifti_dmat44& m) {
  Eigen::Matrix4d out;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) out(row, column) = m.m[row][column];
  return out;
}

class NiftiField : public testing::TestWithParam<const char*> {
 protected:
  TemporaryFolder folder;
  const std::filesystem::path path = folder / GetParam();
  const DisplacementField field = small_field();
};
INSTANTIATE_TEST_SUITE_P(Compression, NiftiField, testing::Values("f.nii", "f.nii.gz"),
                         [](const auto& row) {
                           return std::string(row.param).ends_with("gz") ? "Gzip" : "None";
                         });

TEST_P(NiftiField, VectorsAreTheSlowestAxisAndTheIntentTellsTheirFrame) {
  for (const VectorFrame frame : {VectorFrame::kRas, VectorFrame::kLps}) {
    ASSERT_TRUE(write_nifti(path, field, frame));
    const auto image = read(path);
    EXPECT_EQ(image->ndim, 5);
    EXPECT_EQ(image->nx, 5);
    EXPECT_EQ(image->ny, 4);
    EXPECT_EQ(image->nz, 3);
    EXPECT_EQ(image->nt, 1);
    EXPECT_EQ(image->nu, 3);
    EXPECT_EQ(image->datatype, DT_FLOAT32);
    EXPECT_EQ(image->xyz_units, NIFTI_UNITS_MM);
    EXPECT_EQ(image->intent_code, frame == VectorFrame::kRas ? 1006 : 1007);
    EXPECT_STREQ(image->intent_name, "resampling");
    EXPECT_EQ(std::string(image->descrip),
              "resampling, " + std::string(to_string(frame)) + " mm; update 7, good");
    const auto* values = static_cast<const float*>(image->data);
    const float sign = frame == VectorFrame::kRas ? 1.0F : -1.0F;
    for (std::size_t voxel = 0; voxel < 60; ++voxel) {
      EXPECT_EQ(values[voxel], sign * field.ras_mm[3 * voxel]);
      EXPECT_EQ(values[60 + voxel], sign * field.ras_mm[3 * voxel + 1]);
      EXPECT_EQ(values[120 + voxel], field.ras_mm[3 * voxel + 2]);
    }
  }
  EXPECT_EQ(folder.entries(), 1u);
}

TEST_P(NiftiField, BothFormsHoldTheObliqueFlippedAffine) {
  ASSERT_TRUE(write_nifti(path, field, VectorFrame::kRas));
  const auto image = read(path);
  EXPECT_EQ(image->sform_code, NIFTI_XFORM_SCANNER_ANAT);
  EXPECT_EQ(image->qform_code, NIFTI_XFORM_SCANNER_ANAT);
  EXPECT_EQ(image->qfac, -1.0);
  const Eigen::Matrix4d& truth = field.grid.T_ras_voxel.matrix();
  EXPECT_LT((matrix_of(image->sto_xyz) - truth).cwiseAbs().maxCoeff(), 3e-6);
  EXPECT_LT((matrix_of(image->qto_xyz) - truth).cwiseAbs().maxCoeff(), 3e-6);
}

// Every half turn and reflection of the axes, where a quaternion's parts vanish.
TEST_P(NiftiField, TheQuaternionIsRightForEveryOrientation) {
  for (int permutation = 0; permutation < 6; ++permutation) {
    for (int signs = 0; signs < 8; ++signs) {
      const int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
      DisplacementField turned = field;
      Mat3 axes = Mat3::Zero();
      for (int column = 0; column < 3; ++column) {
        axes(orders[permutation][column], column) =
            ((signs >> column) & 1) != 0 ? -1.0 - column : 1.0 + column;
      }
      turned.grid.T_ras_voxel.linear() = axes;
      ASSERT_TRUE(write_nifti(path, turned, VectorFrame::kRas));
      EXPECT_LT(
          (matrix_of(read(path)->qto_xyz) - turned.grid.T_ras_voxel.matrix()).cwiseAbs().maxCoeff(),
          3e-6)
          << axes;
    }
  }
}

TEST_P(NiftiField, TheSameFieldGivesTheSameBytes) {
  ASSERT_TRUE(write_nifti(path, field, VectorFrame::kLps));
  const std::string before = test_support::content_of(path);
  ASSERT_TRUE(write_nifti(path, field, VectorFrame::kLps));
  EXPECT_EQ(test_support::content_of(path), before);
}

TEST_P(NiftiField, AScalarVolumeIsReadBackByOurReader) {
  const ScalarVolume volume = small_volume();
  ASSERT_TRUE(write_nifti(path, volume));
  const auto image = read_nifti(path);
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->dims, volume.grid.dims);
  EXPECT_EQ(image->values, volume.values);
  EXPECT_LT((image->T_ras_voxel.matrix() - volume.grid.T_ras_voxel.matrix()).cwiseAbs().maxCoeff(),
            3e-6);
  EXPECT_STREQ(read(path)->descrip, "sd");
}

TEST(NiftiWriter, WhatIsInvalidIsRefusedByNameAndNothingWritten) {
  const TemporaryFolder folder;
  DisplacementField field = small_field();
  const Status name = write_nifti(folder / "f.img", field, VectorFrame::kRas);
  EXPECT_THAT(name.error().message, HasSubstr("f.img: must end in .nii or .nii.gz"));
  field.ras_mm[4] = std::numeric_limits<float>::quiet_NaN();
  const Status value = write_nifti(folder / "f.nii", field, VectorFrame::kRas);
  EXPECT_EQ(value.error().code, ErrorCode::kNotFinite);
  EXPECT_THAT(value.error().message, StartsWith((folder / "f.nii").string()));
  ScalarVolume volume = small_volume();
  volume.grid.dims[0] = 6;
  EXPECT_FALSE(write_nifti(folder / "v.nii", volume));
  EXPECT_EQ(folder.entries(), 0u);
  const Status place = write_nifti(folder / "no" / "v.nii.gz", small_volume());
  EXPECT_EQ(place.error().code, ErrorCode::kWriteFailed);
}

}  // namespace
}  // namespace brainshift::io
