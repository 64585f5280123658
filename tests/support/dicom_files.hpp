// SPDX-License-Identifier: GPL-3.0-or-later
// DICOM files of known content, made by DCMTK for tests: a series, a segmentation (SEG), a
// structure set (RTSTRUCT). Places are given in RAS, mm, and written in LPS with six decimals.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/core/mesh.hpp"

namespace brainshift::test_support {

struct DrawnContour {
  Points points;
  std::string type = "CLOSED_PLANAR";
  int points_said = -1;  // NumberOfContourPoints; -1: as many as there are
};

struct DrawnStructure {
  int number = 1;
  std::string name = "GTV";
  std::vector<DrawnContour> contours;
  std::string frame_of_reference = {};  // empty: that of the set
};

struct StructureSet {
  std::vector<DrawnStructure> structures;
  std::string frame_of_reference = "1.2.3.4", series = "1.2.3";
  std::string other_frame = {};  // of another image, which the file names first; empty: none
};

void write_structure_set(const std::filesystem::path& file, const StructureSet& set);

// One file per slice along k, in the folder; values are rounded to 16 bits. Precondition:
// the grid's axes are at right angles and right-handed in LPS.
void write_series(const std::filesystem::path& folder, const VoxelImage& image);

// Binary, a frame for each slice in which a segment lies. Precondition as above.
void write_segmentation(const std::filesystem::path& file, const VoxelImage& labels,
                        const std::map<int, std::string>& names);

// The outlines of a label in every slice along k, half way between the centres of voxels inside and
// outside (marching squares); holes are contours too.
std::vector<DrawnContour> outlines(const VoxelImage& labels, int label);

}  // namespace brainshift::test_support
