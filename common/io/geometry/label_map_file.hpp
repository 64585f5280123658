// SPDX-License-Identifier: GPL-3.0-or-later
// Label maps: NIfTI volumes, those of FreeSurfer (.mgz), and the NRRD volumes and segmentations of
// 3D Slicer (.nrrd, .seg.nrrd).
//
// NRRD: x = space origin + sum_axis index_axis x space direction_axis, in the `space` that the
// file names (left-posterior-superior, right-anterior-superior or left-anterior-superior, or LPS,
// RAS, LAS), taken to RAS. Every integer and float type, raw or gzip, either byte order.
// A segmentation has for segment i the keys Segment<i>_Name, _LabelValue and _Layer. Segments that
// overlap lie in layers: a fourth axis of kind "list". Files of Slicer before 4.11 have neither
// label nor layer: segment i is label 1 in layer i.
// Sources: teem.sourceforge.net/nrrd/format.html; 3D Slicer's documentation, "Segmentations",
// "File formats".
#pragma once

#include <filesystem>
#include <string>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::io {

// What to take from a file.
struct LabelChoice {
  // Of a segmentation. Empty: its only segment.
  std::string segment = {};
  int label = 1;
};

// The volume as the file has it. Of a segmentation only the chosen segment: its voxels have the
// value choice.label and all others 0. `path` ends in .nii, .nii.gz, .hdr, .img, .mgz, .mgh
// or .nrrd.
// kNotFound; kUnreadable naming file and field: as read_nifti and read_mgh, and a space that is
// missing or unknown, directions that are missing, not finite or dependent, units other than mm,
// another number of axes, damaged voxels, a layer that is not there. kInvalidArgument: several
// segments and none chosen, or a segment that the file does not have (its names are listed), or
// one chosen of a file without segments.
Result<VoxelImage> read_label_map(const std::filesystem::path& path,
                                  const LabelChoice& choice = {});
// Any image: of each format that a label map may have.
inline Result<VoxelImage> read_volume(const std::filesystem::path& path) {
  return read_label_map(path);
}

}  // namespace brainshift::io
