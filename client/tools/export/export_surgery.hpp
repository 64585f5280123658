// SPDX-License-Identifier: GPL-3.0-or-later
// An update of a surgery file as a folder of files for other programs.
//
//   displacement-1007.nii.gz  displacement-1006.nii.gz  displacement.nrrd  displacement.h5
//   sd_mm.nii.gz  known.nii.gz  jacobian.nii.gz  warped-NAME.nii.gz  tumour.vtp  cortex.vtp
//   series/  export.json          of a model that has them: ventricles.vtp  septa.vtp
//
// The field is that of sample_field.hpp, on one grid. export.json (manifest.hpp) says of each file
// what it is. The names of an unusable update's files begin with "unusable-". The folder appears
// whole or not at all.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/export/chosen_update.hpp"
#include "client/tools/export/manifest.hpp"
#include "client/tools/volume/field_grid.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/io/fields/displacement_field.hpp"

namespace brainshift::client {

// 2 mm: the field is smooth over the 5 mm of its correlation length, and a head takes 1 million
// voxels.
inline constexpr double kDefaultExportSpacing_mm = 2.0;

struct ExportOptions {
  std::filesystem::path surgery;
  std::filesystem::path model;  // prepared model (.h5) that the surgery was recorded with
  std::filesystem::path out;    // folder: does not exist, or is empty
  UpdateChoice choice;
  // Never implied: who warps an image with the other one moves it the wrong way.
  std::optional<io::FieldDirection> direction;
  std::filesystem::path like;        // NIfTI whose grid is taken; empty: a grid around the brain
  std::optional<double> spacing_mm;  // of that grid around the brain; not with `like`
  std::vector<std::filesystem::path> images;  // NIfTI of the undeformed head, to be warped
  ExportFormats formats = default_formats();
  OutsideTaper taper;
  std::string software;  // for the manifest
};

// Everything that is read is read, and checked, before anything is written. Gives the manifest.
//   kInvalidArgument  no direction (the sentence explains both); --like with --spacing-mm; an image
//                     with direction modeling; two images of one name; an `out` that is not empty;
//                     another model; a grid that is too large, sheared or not near the brain
//   kNotFound, kUnreadable, kEmptySet   as choose_update, read_nifti, read_model, SurgeryFile::open
//   kWriteFailed
// Messages begin with the option or the file that they are about.
Result<Manifest> export_surgery(const ExportOptions& options, const Progress& progress = {});

}  // namespace brainshift::client
