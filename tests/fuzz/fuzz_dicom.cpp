// SPDX-License-Identifier: GPL-3.0-or-later
// DICOM: one image of a series, a segmentation, a structure set whose contours are filled.
#include "common/io/dicom/dicom_segmentation.hpp"
#include "common/io/dicom/dicom_series.hpp"
#include "common/io/dicom/dicom_structures.hpp"
#include "common/io/dicom/filled_contours.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace brainshift::fuzz {
namespace {

void series(const std::filesystem::path& folder) {
  const auto read = io::read_dicom_series(folder);
  if (!read) return;
  require(read->image.values.size() == read->image.num_voxels(), "a series has every voxel");
  require(read->image.T_ras_voxel.matrix().allFinite(), "a series lies somewhere");
}

void segmentation(const std::filesystem::path& file) {
  const auto read = io::read_dicom_segmentation(file);
  if (!read) return;
  require(read->grid.T_ras_voxel.matrix().allFinite(), "a segmentation lies somewhere");
  std::vector<int> numbers;
  for (const auto& [number, voxels] : read->segments) {
    require(voxels.size() == read->grid.num_voxels(), "a segment has every voxel");
    require(read->names.count(number) == 1, "a segment is listed");
    numbers.push_back(number);
  }
  require(io::label_map(*read, numbers).values.size() == read->grid.num_voxels(),
          "a label map has a label for every voxel");
}

void structures(const std::filesystem::path& file) {
  const auto read = io::read_dicom_structures(file);
  if (!read) return;
  VoxelImage grid;
  grid.dims = {16, 16, 8};
  grid.T_ras_voxel.linear().diagonal() << 1.0, 1.0, 2.0;
  for (const io::DicomStructure& structure : read->structures) {
    for (const Points& contour : structure.contours) {
      require(contour.allFinite(), "a contour's points are finite");
    }
    if (!structure.defect.empty()) continue;
    const auto filled = io::fill_contours(structure.contours, grid);
    require(!filled || filled->mask.values.size() == grid.num_voxels(), "a mask has every voxel");
  }
}

}  // namespace

void run(std::string_view bytes) {
  const auto file = scratch_file("one.dcm", bytes);
  if (!io::is_dicom(file)) return;
  series(file.parent_path());
  segmentation(file);
  if (io::is_dicom_structures(file)) structures(file);
}

}  // namespace brainshift::fuzz
