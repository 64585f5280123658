// SPDX-License-Identifier: Apache-2.0
// CaseInputs: the contents of the files that a case names, not interpreted yet.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "common/configuration/case_config.hpp"
#include "common/core/mesh.hpp"

namespace brainshift {

struct CaseInputs {
  CaseConfig config;
  std::optional<VoxelImage> brain;                // when the mesh is generated; > 0 is brain
  std::optional<TetMesh> mesh;                    // when a ready mesh is given
  std::optional<VoxelImage> tumour_labels;        // TumourLabel: its label marks the tumour
  std::optional<TriangleSurface> tumour_surface;  // TumourSurfaceFile
  std::optional<TriangleSurface> skull;           // contact.skull_file
  std::optional<VoxelImage> labels;               // anatomy.labels
  std::map<int, std::string> label_names;         // of the table beside them; empty without one
};

}  // namespace brainshift
