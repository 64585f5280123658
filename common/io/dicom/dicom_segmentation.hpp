// SPDX-License-Identifier: GPL-3.0-or-later
// DICOM segmentations (SEG): segments with numbers and names, frame by frame, to label maps.
//
// Frames lie where their own plane positions say, one, several or none for a slice and in any
// order; slices without a frame are empty. The volume is the segmentation's own, which need not be
// that of the images it was drawn on. Binary frames are bits; fractional ones count from half of
// the largest value on.
// Source: DICOM PS3.3, A.51 and C.8.20.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::io {

struct DicomSegmentation {
  std::map<int, std::string> names;                   // of the segments, by number
  std::map<int, std::vector<std::uint8_t>> segments;  // 1 where a voxel belongs to it
  VoxelImage grid;                                    // without values
  std::string frame_of_reference;                     // UID (0020,0052); empty: not said
};

// Whether a file is DICOM, by the word behind its preamble.
bool is_dicom(const std::filesystem::path& file);

// kNotFound; kUnreadable naming file and tag: no SEG, a frame without position, directions,
// spacing or segment, frames that are not parallel slices at whole steps, pixels that are missing
// or compressed.
Result<DicomSegmentation> read_dicom_segmentation(const std::filesystem::path& file);

// The segments as labels by their numbers; where several lie, the largest number.
// Precondition: each number is one of a segment.
VoxelImage label_map(const DicomSegmentation& segmentation, const std::vector<int>& numbers);

}  // namespace brainshift::io
