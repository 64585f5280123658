// SPDX-License-Identifier: GPL-3.0-or-later
// DICOM structure sets (RTSTRUCT): structures with numbers and names, as closed planar contours.
//
// Contours are places in the patient (LPS, mm) in the structure's own frame of reference, which the
// reader turns into RAS; images, slices and instance numbers that the file refers to do not count.
// ContourData longer than 64 KiB may have the type UN. filled_contours.hpp turns them into voxels.
// Source: DICOM PS3.3, A.19, C.8.8.5 (structure set) and C.8.8.6 (ROI contour).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

struct DicomStructure {
  int number = 0;
  std::string name;
  std::vector<Points> contours;  // RAS, mm
  // Why it encloses nothing, e.g. "contour 1 is POINT"; else empty.
  std::string defect;
  // UIDs of what it was drawn on, its own (3006,0024) and the series that the file names in that
  // frame of reference. Empty where the file does not say.
  std::string frame_of_reference;
  std::vector<std::string> series;
};

struct DicomStructures {
  std::vector<DicomStructure> structures;  // in the file's order
};

// Whether a file is DICOM and a structure set.
bool is_dicom_structures(const std::filesystem::path& file);

// kNotFound; kUnreadable naming file, structure, contour and tag: no structure set, a damaged file,
// two structures of one number, contours of a structure that is not listed, another number of
// points than is said, what is no number or farther than 100 m, a structure that does not say which
// of several frames of reference it lies in.
Result<DicomStructures> read_dicom_structures(const std::filesystem::path& file);

}  // namespace brainshift::io
