// SPDX-License-Identifier: GPL-3.0-or-later
// Read back with HDF5's own calls; ITK itself reads such files in cmake/scripts/interchange.sh.
#include "common/io/fields/field_files.hpp"

#include <gmock/gmock.h>
#include <hdf5.h>

#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/fields/small_field.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;

std::vector<double> doubles(hid_t file, const std::string& name) {
  const hid_t set = H5Dopen2(file, ("TransformGroup/0/" + name).c_str(), H5P_DEFAULT);
  EXPECT_GE(set, 0) << name;
  const hid_t type = H5Dget_type(set), space = H5Dget_space(set);
  EXPECT_EQ(H5Tget_class(type), H5T_FLOAT);
  EXPECT_EQ(H5Tget_size(type), 8u);
  EXPECT_EQ(H5Sget_simple_extent_ndims(space), 1);
  std::vector<double> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  EXPECT_GE(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  H5Sclose(space);
  H5Tclose(type);
  H5Dclose(set);
  return values;
}

std::string type_text(hid_t file) {
  const hid_t set = H5Dopen2(file, "TransformGroup/0/TransformType", H5P_DEFAULT);
  const hid_t stored = H5Dget_type(set);
  EXPECT_GT(H5Tis_variable_str(stored), 0);
  EXPECT_EQ(H5Tget_cset(stored), H5T_CSET_ASCII);
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, H5T_VARIABLE);
  char* text = nullptr;
  EXPECT_GE(H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &text), 0);
  const std::string out = text;
  H5free_memory(text);
  H5Tclose(type);
  H5Tclose(stored);
  H5Dclose(set);
  return out;
}

TEST(ItkTransformFile, HoldsOneTransformWithEighteenFixedParameters) {
  const TemporaryFolder folder;
  const DisplacementField field = small_field();
  ASSERT_TRUE(write_itk_transform(folder / "f.h5", field));
  EXPECT_EQ(folder.entries(), 1u);
  const hid_t file = H5Fopen((folder / "f.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  EXPECT_EQ(type_text(file), "DisplacementFieldTransform_double_3_3");
  const auto fixed = doubles(file, "TransformFixedParameters");
  const auto parameters = doubles(file, "TransformParameters");
  H5Fclose(file);

  ASSERT_EQ(fixed.size(), 18u);
  EXPECT_EQ(fixed[0], 5.0);
  EXPECT_EQ(fixed[1], 4.0);
  EXPECT_EQ(fixed[2], 3.0);
  // x_lps = origin + direction diag(spacing) (i, j, k)
  const Vec3 origin(fixed[3], fixed[4], fixed[5]), spacing(fixed[6], fixed[7], fixed[8]);
  const Mat3 direction = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&fixed[9]);
  for (const Vec3& voxel : {Vec3(0, 0, 0), Vec3(4, 0, 0), Vec3(1, 3, 2)}) {
    const Vec3 ras = field.grid.T_ras_voxel * voxel;
    const Vec3 lps = origin + direction * spacing.cwiseProduct(voxel);
    EXPECT_LT((lps - Vec3(-ras.x(), -ras.y(), ras.z())).norm(), 1e-12);
  }
  ASSERT_EQ(parameters.size(), field.ras_mm.size());
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    EXPECT_EQ(parameters[i], i % 3 < 2 ? -field.ras_mm[i] : field.ras_mm[i]);
  }
}

// More than one compressed piece, the last one partly filled.
TEST(ItkTransformFile, ALargeFieldIsWhole) {
  const TemporaryFolder folder;
  DisplacementField field = small_field();
  field.grid.dims = {60, 50, 31};
  field.ras_mm.resize(3 * field.grid.num_voxels());
  for (std::size_t i = 0; i < field.ras_mm.size(); ++i) {
    field.ras_mm[i] = static_cast<float>(i % 1009) - 500.0F;
  }
  ASSERT_TRUE(write_itk_transform(folder / "f.h5", field));
  const hid_t file = H5Fopen((folder / "f.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const auto parameters = doubles(file, "TransformParameters");
  H5Fclose(file);
  ASSERT_EQ(parameters.size(), field.ras_mm.size());
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    wrong += parameters[i] != (i % 3 < 2 ? -field.ras_mm[i] : field.ras_mm[i]) ? 1 : 0;
  }
  EXPECT_EQ(wrong, 0u);
}

TEST(ItkTransformFile, WhatIsInvalidIsRefusedByNameAndNothingWritten) {
  const TemporaryFolder folder;
  DisplacementField field = small_field();
  EXPECT_THAT(write_itk_transform(folder / "f.tfm", field).error().message,
              HasSubstr("f.tfm: must end in .h5"));
  EXPECT_EQ(write_itk_transform(folder / "no" / "f.h5", field).error().code,
            ErrorCode::kWriteFailed);
  field.note = "\t";
  EXPECT_THAT(write_itk_transform(folder / "f.h5", field).error().message, HasSubstr("f.h5: note"));
  EXPECT_EQ(folder.entries(), 0u);
}

}  // namespace
}  // namespace brainshift::io
