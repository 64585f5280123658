// SPDX-License-Identifier: GPL-3.0-or-later
// What an export consists of, by the words of `brainshift export --formats`.
#pragma once

#include <array>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::client {

enum class ExportFormat {
  kNiftiLps,  // the field for ITK, ANTs, plastimatch
  kNiftiRas,  // the field for 3D Slicer
  kNrrd,      // the field for elastix, plastimatch, 3D Slicer
  kItk,       // the field as a transform of ITK
  kSd,
  kJacobian,
  kSurfaces,
  kSeries,  // every usable field of the journal, for ParaView
};
inline constexpr std::array kAllExportFormats = {ExportFormat::kNiftiLps, ExportFormat::kNiftiRas,
                                                 ExportFormat::kNrrd,     ExportFormat::kItk,
                                                 ExportFormat::kSd,       ExportFormat::kJacobian,
                                                 ExportFormat::kSurfaces, ExportFormat::kSeries};

// "nifti-1007", "nifti-1006", "nrrd", "itk", "sd", "jacobian", "surfaces", "series"
std::string_view to_string(ExportFormat format);

using ExportFormats = std::set<ExportFormat>;
// All but the series, which is as large as the journal.
ExportFormats default_formats();
// From the words; "all" stands for all of them. kInvalidArgument names a word that is none, and the
// words there are. No word: the default.
Result<ExportFormats> parse_formats(const std::vector<std::string>& words);

}  // namespace brainshift::client
