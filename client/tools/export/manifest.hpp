// SPDX-License-Identifier: GPL-3.0-or-later
// What an export consists of, and its manifest.
#pragma once

#include <array>
#include <cstddef>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "client/tools/volume/field_grid.hpp"
#include "common/core/error.hpp"
#include "common/io/fields/displacement_field.hpp"
#include "common/io/recording/surgery_record.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

// By the words of `brainshift export --formats`.
enum class ExportFormat {
  kNiftiLps,  // the field for ITK, ANTs, plastimatch
  kNiftiRas,  // the field for 3D Slicer
  kNrrd,      // the field for elastix, plastimatch, 3D Slicer
  kItk,       // the field as a transform of ITK
  kSd,
  kKnown,
  kJacobian,
  kSurfaces,
  kSeries,  // every usable field of the journal, for ParaView
};
inline constexpr std::array kAllExportFormats = {
    ExportFormat::kNiftiLps, ExportFormat::kNiftiRas, ExportFormat::kNrrd,
    ExportFormat::kItk,      ExportFormat::kSd,       ExportFormat::kKnown,
    ExportFormat::kJacobian, ExportFormat::kSurfaces, ExportFormat::kSeries};

// "nifti-1007", "nifti-1006", "nrrd", "itk", "sd", "known", "jacobian", "surfaces", "series"
std::string_view to_string(ExportFormat format);

using ExportFormats = std::set<ExportFormat>;
// All but the series, which is as large as the journal.
ExportFormats default_formats();
// From the words; "all" stands for all of them. kInvalidArgument names a word that is none, and the
// words there are. No word: the default.
Result<ExportFormats> parse_formats(const std::vector<std::string>& words);

// export.json: what the files of an export are, so that nobody has to guess a direction, a frame or
// a unit.
//
//   {
//     "software", "surgery", "case_id", "model_id", "session_id", "sequence",
//     "observation_sequence", "time_s",                  of the update; time since the first record
//     "quality": {"verdict", "usable", "flags": [..], "reason"},
//     "direction": "resampling" | "modeling", "direction_means": a sentence,
//     "grid": {"dims", "spacing_mm", "T_ras_voxel": 4 rows, "voxels_in_brain"},
//     "outside_brain": {"full_mm", "zero_mm", "means"},
//     "largest_mm",                                      of the field's vectors
//     "volume_ratio": {"min", "max", "below_half": elements, "folded": elements, "elements"},
//     "files": [ {"file", "content", "direction", "points_frame", "vectors_frame", "units",
//                 "session_id", "model_id", "sequence", "quality", "read_by"} ]
//   }
//
// A member of a file that has no meaning for it is null. folded: elements that the displacement
// turns inside out (det(I + grad u) <= 0). A series holds every usable field: its sequence and
// quality are null.
struct ManifestFile {
  std::string file;  // relative to the manifest
  std::string content;
  std::string direction;      // "resampling", "modeling"; empty: has none
  std::string points_frame;   // how the file states places: "RAS" or "LPS"
  std::string vectors_frame;  // empty: holds no vectors
  std::string units;
  std::string read_by;
  bool of_one_update = true;  // false: a series
};

struct Manifest {
  std::string software;
  std::string surgery;  // file name
  std::string case_id;
  UpdateMessage message;  // the update's field is not looked at
  double time_s = 0.0;
  io::FieldDirection direction = io::FieldDirection::kResampling;
  io::VoxelGrid grid;
  std::size_t voxels_in_brain = 0;
  double largest_mm = 0.0;
  OutsideTaper taper;
  VecX volume_ratios;  // one per element
  std::vector<ManifestFile> files;
};

// One sentence on what x + v(x) is.
std::string direction_means(io::FieldDirection direction);

// The text of export.json, with a line feed at the end.
std::string to_json(const Manifest& manifest);

}  // namespace brainshift::client
