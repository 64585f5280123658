// SPDX-License-Identifier: GPL-3.0-or-later
// What the report's pictures need of a case and of a run's field file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/replay/run_report.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/progress.hpp"
#include "common/core/types.hpp"

namespace brainshift::client {

// Rebuilt from the case file; mm RAS, undeformed.
struct Head {
  std::string model_id;
  std::optional<VoxelImage> mri;  // absent when the case names none
  TriangleSurface tumour;
  TriangleSurface septa, ventricles;      // falx and tentorium; walls; empty without labels
  Vec3 craniotomy_centre = Vec3::Zero();  // mean of the craniotomy nodes
  Vec3 tumour_centre = Vec3::Zero();      // mean of the tumour's vertices
  Vec3 gravity_direction = Vec3::Zero();
};
// Errors: of reading the case and its files, and of building its model.
Result<Head> load_head(const std::filesystem::path& case_file, const Progress& progress);

// The .vtu that replay wrote beside report.json.
struct RunField {
  TetMesh mesh;
  Points estimated;  // 3 x n displacement, undeformed to deformed, mm
  std::optional<Points> truth;
  VecX known = {};  // n, 0 to 1 (Estimate::known), or empty
  VecX sd_mm = {};  // n, mm (Estimate::sd_mm), or empty
};
// kNotFound; kUnreadable when the array displacement_estimated is missing or an array misshapen.
Result<RunField> load_field(const std::filesystem::path& path);

// A run with its field, if it has one.
struct ReportedRun {
  RunReport report;
  std::optional<RunField> field;
};

// Runs that differ in the boundary condition only, shown side by side. Indices into the runs.
struct RunGroup {
  std::string name;  // unique among the groups, fit for file names
  std::optional<std::size_t> contact;
  std::optional<std::size_t> fixed;

  std::size_t any() const { return contact ? *contact : *fixed; }
};
// In order of appearance; a second run of the same kind opens another group.
std::vector<RunGroup> group_runs(const std::vector<ReportedRun>& runs);

// Keeps letters, digits, '-' and '_'; everything else becomes '-'.
std::string file_name_from(const std::string& text);

}  // namespace brainshift::client
