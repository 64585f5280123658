// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/export/export_format.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace brainshift::client {

std::string_view to_string(ExportFormat format) {
  switch (format) {
    case ExportFormat::kNiftiLps: return "nifti-1007";
    case ExportFormat::kNiftiRas: return "nifti-1006";
    case ExportFormat::kNrrd: return "nrrd";
    case ExportFormat::kItk: return "itk";
    case ExportFormat::kSd: return "sd";
    case ExportFormat::kJacobian: return "jacobian";
    case ExportFormat::kSurfaces: return "surfaces";
    case ExportFormat::kSeries: return "series";
  }
  return "";
}

ExportFormats default_formats() {
  ExportFormats formats(kAllExportFormats.begin(), kAllExportFormats.end());
  formats.erase(ExportFormat::kSeries);
  return formats;
}

Result<ExportFormats> parse_formats(const std::vector<std::string>& words) {
  if (words.empty()) return default_formats();
  ExportFormats formats;
  for (const std::string& word : words) {
    if (word == "all") {
      formats.insert(kAllExportFormats.begin(), kAllExportFormats.end());
      continue;
    }
    const auto known = std::find_if(kAllExportFormats.begin(), kAllExportFormats.end(),
                                    [&](ExportFormat format) { return to_string(format) == word; });
    if (known == kAllExportFormats.end()) {
      std::string all;
      for (const ExportFormat format : kAllExportFormats)
        all += fmt::format("{}, ", to_string(format));
      return fail(ErrorCode::kInvalidArgument,
                  fmt::format("--formats: \"{}\" is not a format: must be {}or all", word, all));
    }
    formats.insert(*known);
  }
  return formats;
}

}  // namespace brainshift::client
