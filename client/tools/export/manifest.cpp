// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/export/manifest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace brainshift::client {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(const std::string& text) { return text.empty() ? Json() : Json(text); }

Json grid_json(const Manifest& manifest) {
  const io::VoxelGrid& grid = manifest.grid;
  const Vec3 spacing = grid.spacing_mm();
  Json rows = Json::array();
  for (int row = 0; row < 4; ++row) {
    Json numbers = Json::array();
    for (int column = 0; column < 4; ++column) {
      numbers.push_back(grid.T_ras_voxel.matrix()(row, column));
    }
    rows.push_back(std::move(numbers));
  }
  return {{"dims", grid.dims},
          {"spacing_mm", {spacing.x(), spacing.y(), spacing.z()}},
          {"T_ras_voxel", std::move(rows)},
          {"voxels_in_brain", manifest.voxels_in_brain}};
}

Json quality_json(const Update& update) {
  const QualityVerdict& verdict = update.estimate.quality;
  Json flags = Json::array();
  for (const QualityFlag flag : kAllQualityFlags) {
    if (verdict.flags.has(flag)) flags.push_back(to_string(flag));
  }
  return {{"verdict", to_string(verdict.quality)},
          {"usable", update.usable()},
          {"flags", std::move(flags)},
          {"reason", verdict.reason}};
}

Json ratio_json(const VecX& ratios) {
  const auto count = [&](double bound) { return (ratios.array() <= bound).count(); };
  return {{"min", ratios.size() > 0 ? Json(ratios.minCoeff()) : Json()},
          {"max", ratios.size() > 0 ? Json(ratios.maxCoeff()) : Json()},
          {"below_half", count(kMinVolumeRatio)},
          {"folded", count(0.0)},
          {"elements", ratios.size()}};
}

Json file_json(const ManifestFile& file, const Manifest& manifest) {
  const Update& update = manifest.message.update;
  const bool one = file.of_one_update;
  return {{"file", file.file},
          {"content", file.content},
          {"direction", or_null(file.direction)},
          {"points_frame", file.points_frame},
          {"vectors_frame", or_null(file.vectors_frame)},
          {"units", file.units},
          {"session_id", manifest.message.session_id},
          {"model_id", update.model_id},
          {"sequence", one ? Json(update.sequence) : Json()},
          {"quality", one ? Json(to_string(update.estimate.quality.quality)) : Json()},
          {"read_by", file.read_by}};
}

}  // namespace

std::string_view to_string(ExportFormat format) {
  switch (format) {
    case ExportFormat::kNiftiLps: return "nifti-1007";
    case ExportFormat::kNiftiRas: return "nifti-1006";
    case ExportFormat::kNrrd: return "nrrd";
    case ExportFormat::kItk: return "itk";
    case ExportFormat::kSd: return "sd";
    case ExportFormat::kKnown: return "known";
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
      return invalid(fmt::format("--formats: \"{}\" is not a format: must be {}or all", word, all));
    }
    formats.insert(*known);
  }
  return formats;
}

std::string direction_means(io::FieldDirection direction) {
  return direction == io::FieldDirection::kResampling
             ? "x + v(x) is the undeformed place of the deformed point x: for resampling images"
             : "x + v(x) is the deformed place of the undeformed point x: for points and models";
}

std::string to_json(const Manifest& manifest) {
  const Update& update = manifest.message.update;
  Json files = Json::array();
  for (const ManifestFile& file : manifest.files) files.push_back(file_json(file, manifest));
  const Json json = {{"software", manifest.software},
                     {"surgery", manifest.surgery},
                     {"case_id", manifest.case_id},
                     {"model_id", update.model_id},
                     {"session_id", manifest.message.session_id},
                     {"sequence", update.sequence},
                     {"observation_sequence", update.observation_sequence},
                     {"time_s", manifest.time_s},
                     {"quality", quality_json(update)},
                     {"direction", to_string(manifest.direction)},
                     {"direction_means", direction_means(manifest.direction)},
                     {"grid", grid_json(manifest)},
                     {"outside_brain",
                      {{"full_mm", manifest.taper.full_mm},
                       {"zero_mm", manifest.taper.zero_mm},
                       {"means",
                        "no model says what lies there: the closest surface point's value, which "
                        "falls to zero between full_mm and zero_mm"}}},
                     {"largest_mm", manifest.largest_mm},
                     {"volume_ratio", ratio_json(manifest.volume_ratios)},
                     {"files", std::move(files)}};
  // Names of files are bytes; what is not UTF-8 is replaced.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace brainshift::client
