// SPDX-License-Identifier: GPL-3.0-or-later
// How exact the readers of DICOM are, in figures: a series against the same volume as NIfTI, a
// segmentation and a structure set against the label map that they were made of. Each figure is
// printed beside its bound.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "common/io/dicom/dicom_segmentation.hpp"
#include "common/io/dicom/dicom_series.hpp"
#include "common/io/dicom/dicom_structures.hpp"
#include "common/io/dicom/filled_contours.hpp"
#include "common/io/fields/field_files.hpp"
#include "common/io/geometry/image_file.hpp"
#include "tests/support/dicom_files.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;

constexpr double kPosition_mm = 0.01, kVolume_percent = 1.0;

void expect_at_most(const char* figure, double value, double bound, const char* unit) {
  std::printf("[ figure   ] %s: %.4g %s (<= %g)\n", figure, value, unit, bound);
  EXPECT_LE(value, bound) << figure;
}

// Oblique, anisotropic, right-handed in LPS (and so in RAS): a head's grid in small.
VoxelImage oblique_grid(const Vec3& step_mm) {
  VoxelImage image;
  image.dims = {56, 64, 30};
  Mat3 axes = Eigen::AngleAxisd(0.3, Vec3(2, -1, 1).normalized()).toRotationMatrix();
  axes.col(0) *= -1.0, axes.col(1) *= -1.0;  // as DICOM has them: to the left, to the back
  image.T_ras_voxel.linear() = axes * step_mm.asDiagonal();
  image.T_ras_voxel.translation() =
      Vec3(12, -7, 31) - image.T_ras_voxel.linear() * Vec3(27.5, 31.5, 14.5);
  return image;
}

// A tumour (1) with a cavity (2) in it and a focus of its own, and a structure beside it (3).
int label_at(const Vec3& x) {
  const Vec3 off = x - Vec3(12, -7, 31);
  if ((off - Vec3(-3, 2, 1)).norm() < 5.0) return 2;
  if (off.cwiseQuotient(Vec3(15, 18, 12)).norm() < 1.0 || (off - Vec3(20, -15, 3)).norm() < 4.0)
    return 1;
  return (off - Vec3(-18, 12, -4)).norm() < 7.0 ? 3 : 0;
}

template <typename Value>
VoxelImage drawn(VoxelImage image, const Value& value) {
  for (int k = 0; k < image.dims[2]; ++k)
    for (int j = 0; j < image.dims[1]; ++j)
      for (int i = 0; i < image.dims[0]; ++i)
        image.values.push_back(static_cast<float>(value(image.T_ras_voxel * Vec3(i, j, k))));
  return image;
}

double labelled_mm3(const VoxelImage& image, float label) {
  return static_cast<double>(std::count(image.values.begin(), image.values.end(), label)) *
         std::abs(image.T_ras_voxel.linear().determinant());
}

// Farthest of the voxels' centres; the maps are affine, so corners are enough.
double farthest_mm(const VoxelImage& a, const VoxelImage& b) {
  double farthest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 at((corner & 1) * (a.dims[0] - 1), (corner >> 1 & 1) * (a.dims[1] - 1),
                  (corner >> 2) * (a.dims[2] - 1));
    farthest = std::max(farthest, (a.T_ras_voxel * at - b.T_ras_voxel * at).norm());
  }
  return farthest;
}

void compare_series(const DicomSeries& series, const VoxelImage& nifti) {
  ASSERT_EQ(series.image.dims, nifti.dims);
  expect_at_most("DICOM series against NIfTI, farthest voxel", farthest_mm(series.image, nifti),
                 kPosition_mm, "mm");
  EXPECT_TRUE(series.image.values == nifti.values);
}

VoxelImage as_nifti(const TemporaryFolder& folder, const VoxelImage& image) {
  EXPECT_TRUE(write_nifti(folder / "volume.nii.gz",
                          {{image.dims, image.T_ras_voxel}, image.values, "test"}));
  return value_or_fail(read_nifti(folder / "volume.nii.gz"));
}

TEST(ReaderFigures, ASeriesLiesWhereTheSameVolumeAsNiftiLies) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "series");
  const VoxelImage image = drawn(oblique_grid(Vec3(0.94, 0.94, 1.7)), [](const Vec3& x) {
    return std::round(400.0 + 9.0 * x.x() - 5.0 * x.y() + 3.0 * x.z());
  });
  test_support::write_series(folder / "series", image);
  compare_series(value_or_fail(read_dicom_series(folder / "series")), as_nifti(folder, image));
}

TEST(ReaderFigures, ARealSeriesLiesWhereTheSameVolumeAsNiftiLies) {
  const char* data = std::getenv("BRAINSHIFT_EXTERNAL_DATA");
  if (data == nullptr) GTEST_SKIP() << "BRAINSHIFT_EXTERNAL_DATA is not set";
  const TemporaryFolder folder;
  const auto series =
      value_or_fail(read_dicom_series(std::filesystem::path(data) / "dicom_t1/HFS"));
  compare_series(series, as_nifti(folder, series.image));
}

TEST(ReaderFigures, ASegmentationHasTheVolumesOfItsLabelMap) {
  const TemporaryFolder folder;
  const VoxelImage map = drawn(oblique_grid(Vec3(0.94, 0.94, 1.7)), label_at);
  test_support::write_segmentation(folder / "seg.dcm", map,
                                   {{1, "Tumour"}, {2, "Cavity"}, {3, "Other"}});
  const auto seg = value_or_fail(read_dicom_segmentation(folder / "seg.dcm"));
  for (const int label : {1, 2, 3}) {
    const double truth = labelled_mm3(map, static_cast<float>(label));
    ASSERT_GT(truth, 100.0);
    expect_at_most(
        "SEG against its label map, volume",
        100.0 * std::abs(labelled_mm3(label_map(seg, {label}), static_cast<float>(label)) / truth -
                         1.0),
        kVolume_percent, "%");
  }
}

// On the grid that the contours were drawn on, and on one of other voxels and directions.
TEST(ReaderFigures, AStructureSetHasTheVolumesOfTheLabelMapThatItWasDrawnFrom) {
  const TemporaryFolder folder;
  const VoxelImage map = drawn(oblique_grid(Vec3(0.94, 0.94, 1.7)), label_at);
  test_support::StructureSet set;
  for (const int label : {1, 2, 3})
    set.structures.push_back(
        {label, "structure " + std::to_string(label), test_support::outlines(map, label)});
  test_support::write_structure_set(folder / "rs.dcm", set);
  const auto read_set = value_or_fail(read_dicom_structures(folder / "rs.dcm"));
  VoxelImage other = oblique_grid(Vec3(0.7, 0.7, 0.7));
  other.dims = {130, 130, 130};
  other.T_ras_voxel.linear() = 0.6 * Mat3::Identity();
  other.T_ras_voxel.translation() = Vec3(12, -7, 31) - Vec3::Constant(0.6 * 64.5);
  for (const DicomStructure& one : read_set.structures) {
    const double truth = labelled_mm3(map, static_cast<float>(one.number));
    const auto off = [&](const VoxelImage& on) {
      const auto filled = value_or_fail(fill_contours(one.contours, on));
      return 100.0 * std::abs(labelled_mm3(filled.mask, 1.0F) / truth - 1.0);
    };
    expect_at_most("RTSTRUCT against its label map, volume", off(map), kVolume_percent, "%");
    expect_at_most("RTSTRUCT on another grid, volume", off(other), kVolume_percent, "%");
  }
  // Voxel by voxel, too: the cavity is a hole of the tumour.
  const auto tumour = value_or_fail(fill_contours(read_set.structures[0].contours, map));
  for (std::size_t v = 0; v < map.values.size(); ++v)
    ASSERT_EQ(tumour.mask.values[v] > 0.0F, map.values[v] == 1.0F) << v;
}

}  // namespace
}  // namespace brainshift::io
