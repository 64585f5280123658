// SPDX-License-Identifier: GPL-3.0-or-later
// NIfTI is read back by libnifti, and the scalar volume by our own reader, which is tested on its
// own; NRRD line by line and by zlib. ITK, elastix and plastimatch read such files in
// cmake/scripts/interchange.sh.
#include "common/io/fields/field_files.hpp"

#include <gmock/gmock.h>
#include <nifti2_io.h>
#include <zlib.h>

#include <cstdio>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <sstream>
#include <vector>

#include "common/io/geometry/image_file.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/fields/small_field.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::StartsWith;

// ---- NIfTI ----

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
  EXPECT_THAT(refusal_of(value, ErrorCode::kNotFinite), StartsWith((folder / "f.nii").string()));
  ScalarVolume volume = small_volume();
  volume.grid.dims[0] = 6;
  EXPECT_FALSE(write_nifti(folder / "v.nii", volume));
  EXPECT_EQ(folder.entries(), 0u);
  refusal_of(write_nifti(folder / "no" / "v.nii.gz", small_volume()), ErrorCode::kWriteFailed);
}

// ---- NRRD ----

struct Nrrd {
  std::string magic;
  std::map<std::string, std::string> keys;  // fields and key/value pairs
  std::vector<float> values;
};

// gzread takes what follows the header for a gzip stream of its own.
Nrrd read_nrrd_field(const std::filesystem::path& path) {
  const std::string content = test_support::content_of(path);
  const std::size_t end = content.find("\n\n");
  Nrrd nrrd;
  std::istringstream header(content.substr(0, end));
  std::getline(header, nrrd.magic);
  for (std::string line; std::getline(header, line);) {
    if (line[0] == '#') continue;
    const std::size_t pair = line.find(":="), colon = line.find(": ");
    const bool is_pair = pair != std::string::npos && pair < colon;
    nrrd.keys[line.substr(0, is_pair ? pair : colon)] = line.substr((is_pair ? pair : colon) + 2);
  }
  std::string packed = content.substr(end + 2);
  std::string bytes(1 << 16, '\0');
  z_stream stream{};
  inflateInit2(&stream, 16 + MAX_WBITS);
  stream.next_in = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_out = static_cast<uInt>(bytes.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  nrrd.values.resize(stream.total_out / sizeof(float));
  std::memcpy(nrrd.values.data(), bytes.data(), stream.total_out);
  inflateEnd(&stream);
  return nrrd;
}

Vec3 vector_of(const std::string& text) {
  Vec3 v = Vec3::Zero();
  EXPECT_EQ(std::sscanf(text.c_str(), "(%lf,%lf,%lf)", &v[0], &v[1], &v[2]), 3) << text;
  return v;
}

TEST(NrrdWriter, SaysWhatTheFieldIs) {
  const TemporaryFolder folder;
  DisplacementField field = small_field();
  ASSERT_TRUE(write_nrrd(folder / "f.nrrd", field));
  auto nrrd = read_nrrd_field(folder / "f.nrrd");
  EXPECT_EQ(nrrd.magic, "NRRD0005");
  EXPECT_EQ(nrrd.keys["type"], "float");
  EXPECT_EQ(nrrd.keys["space"], "left-posterior-superior");
  EXPECT_EQ(nrrd.keys["sizes"], "3 5 4 3");
  EXPECT_EQ(nrrd.keys["kinds"], "vector domain domain domain");
  EXPECT_EQ(nrrd.keys["endian"], "little");
  EXPECT_EQ(nrrd.keys["intent_code"], "1006");
  EXPECT_EQ(nrrd.keys["displacement field type"], "resampling");
  EXPECT_EQ(nrrd.keys["brainshift note"], "update 7, good");
  field.direction = FieldDirection::kModeling;
  ASSERT_TRUE(write_nrrd(folder / "f.nrrd", field));
  EXPECT_EQ(read_nrrd_field(folder / "f.nrrd").keys["displacement field type"], "modeling");
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(NrrdWriter, PlacesAndVectorsAreLps) {
  const TemporaryFolder folder;
  const DisplacementField field = small_field();
  ASSERT_TRUE(write_nrrd(folder / "f.nrrd", field));
  auto nrrd = read_nrrd_field(folder / "f.nrrd");
  const Mat3 lps_ras = Vec3(-1, -1, 1).asDiagonal();
  EXPECT_EQ(vector_of(nrrd.keys["space origin"]),
            Vec3(lps_ras * field.grid.T_ras_voxel.translation()));
  std::istringstream directions(nrrd.keys["space directions"]);
  std::string word;
  directions >> word;
  EXPECT_EQ(word, "none");
  for (int axis = 0; axis < 3; ++axis) {
    directions >> word;
    EXPECT_EQ(vector_of(word), Vec3(lps_ras * field.grid.T_ras_voxel.linear().col(axis)));
  }
  ASSERT_EQ(nrrd.values.size(), field.ras_mm.size());
  for (std::size_t i = 0; i < nrrd.values.size(); ++i) {
    EXPECT_EQ(nrrd.values[i], i % 3 < 2 ? -field.ras_mm[i] : field.ras_mm[i]);
  }
}

TEST(NrrdWriter, WhatIsInvalidIsRefusedByNameAndNothingWritten) {
  const TemporaryFolder folder;
  DisplacementField field = small_field();
  EXPECT_THAT(write_nrrd(folder / "f.nhdr", field).error().message,
              HasSubstr("f.nhdr: must end in .nrrd"));
  EXPECT_EQ(write_nrrd(folder / "no" / "f.nrrd", field).error().code, ErrorCode::kWriteFailed);
  field.ras_mm.pop_back();
  EXPECT_THAT(write_nrrd(folder / "f.nrrd", field).error().message,
              HasSubstr("f.nrrd: volume has"));
  EXPECT_EQ(folder.entries(), 0u);
}

}  // namespace
}  // namespace brainshift::io
