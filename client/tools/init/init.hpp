// SPDX-License-Identifier: GPL-3.0-or-later
// A first case file from what a hospital has of a patient: guesses, each with where it comes from,
// for a person to look at (`brainshift preview`) and to correct.
//
//   brain       the given mask; else anatomy::brain_from_labels, written beside the case as
//               NAME-brain.nii.gz
//   brainstem   the lowest 8 mm of label 16; without labels, of the brain near its middle (15 mm)
//   opening     over the tumour: the place nearest to its centre of those that are outermost (to
//               3 mm) in some direction that is not more than 17 degrees down, as the hull's are
//   gravity     position.hpp
// An MRI that is a folder is a DICOM series (io/dicom); it is written beside the case as
// NAME-mri.nii.gz. So is a tumour from a DICOM segmentation, as NAME-tumour.nii.gz, whose labels
// are the segments' numbers, or from a DICOM structure set (RTSTRUCT), whose contours are filled on
// the MRI's grid and whose labels are the structures' numbers.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"

namespace brainshift::client {

struct InitOptions {
  std::filesystem::path mri;        // a volume, or a folder with a DICOM series
  std::filesystem::path labels;     // FreeSurfer's numbers, or names in a *_dseg.tsv beside it
  std::filesystem::path brain;      // a mask
  std::filesystem::path tumour;     // a label map or segmentation
  std::string tumour_label = {};    // numbers, or names of a *_dseg.tsv or of DICOM
  std::string tumour_segment = {};  // of a .seg.nrrd
  std::string position;
  std::filesystem::path out;  // its name without extension names the case
};

struct InitSummary {
  std::vector<std::string> guesses;  // a sentence each, as in the case
  std::vector<std::filesystem::path> files;
};

// Writes the case, which io::read_case_config reads with the same names. kInvalidArgument: options
// that are missing (all of them in one sentence), a case or volume that is there already, a name
// that is no UTF-8, a position, a label map with values that are no whole numbers, labels that
// the tumour's map does not have (those that it has are listed), several labels and none chosen
// where they are not BraTS's (1, 2 and 3 or 4: then all but 2, oedema), a segmentation or structure
// set of another frame of reference than the series, a tumour of more than half the brain or mostly
// outside of it, an MRI for a label map or for the brain. Errors
// of the readers and of io::fill_contours; kWriteFailed.
Result<InitSummary> write_first_case(const InitOptions& options);

// As above. outward: the direction in which the place is outermost; unit.
struct OpeningGuess {
  Vec3 centre = Vec3::Zero(), outward = Vec3::Zero();
};
// Precondition: a voxel of the mask is > 0.
OpeningGuess opening_over(const VoxelImage& mask, const Vec3& tumour);

// The mean of the lowest 8 mm (along S) of the voxels > 0, of those within `half_width_mm` of
// their middle (along R).
Vec3 lowest_part(const VoxelImage& mask, double half_width_mm);

}  // namespace brainshift::client
