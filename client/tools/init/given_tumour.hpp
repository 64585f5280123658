// SPDX-License-Identifier: GPL-3.0-or-later
// The tumour as a hospital has it, as a label map, and which of its labels are the tumour:
//
//   label map            the only label; BraTS's (1, 2 and 3 or 4) all but 2, oedema; a soft mask;
//                        else those of --tumour-label, numbers or names of the table beside it
//   .seg.nrrd            the segment of --tumour-segment, or the only one
//   DICOM SEG            the only segment, or those of --tumour-label, by number or name
//   DICOM RTSTRUCT       the same of its structures, whose contours are filled on the MRI's grid
//                        (io/dicom/filled_contours.hpp)
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"

namespace brainshift::client {

struct GivenTumour {
  VoxelImage map;           // labels as numbers; of DICOM those of segments or structures
  std::vector<int> labels;  // the tumour's
  std::string why;          // these, as words
  std::vector<std::string> notes;
  bool from_dicom = false;  // no file holds `map` yet
};

struct TumourFile {
  std::filesystem::path file;
  std::string label;    // --tumour-label: numbers, or names
  std::string segment;  // --tumour-segment: of a .seg.nrrd
};

// Of an MRI from DICOM (0020,0052; 0020,000E); of others, and where not given, empty.
struct MriIdentity {
  std::string frame_of_reference, series;
};

// grid: of the MRI. What DICOM drew must lie in the MRI's frame of reference.
// kInvalidArgument: both label and segment, a segment of DICOM, labels that are not there (those
// that are, are listed with their volumes), several and none chosen, another frame of reference.
// Errors of the readers and of io::fill_contours.
Result<GivenTumour> read_tumour(const TumourFile& given, const VoxelImage& grid,
                                const MriIdentity& mri);

// Where the tumour's voxels (their centres, mm RAS) lie against the brain's mask: a doubt, as a
// sentence, when some lie farther outside than preparation would cut (anatomy::kLargestCut_mm);
// else "". Of many voxels a part is looked at. `what`: of the sentence. kInvalidArgument: more than
// half of them lie outside; with the share, the distance and the mistake that would explain it
// (geometry::likely_mistake).
Result<std::string> place_in_brain(const Points& voxels, const VoxelImage& brain,
                                   const std::string& what);

}  // namespace brainshift::client
