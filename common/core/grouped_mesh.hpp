// SPDX-License-Identifier: Apache-2.0
// A tetrahedral mesh with the names that its file gives to regions and surfaces.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/core/mesh.hpp"

namespace brainshift {

// The volume labels are mesh.labels. Triangles have labels of their own (0: none); a triangle
// that belongs to several groups is listed once per group. Names map to labels. A label without a
// name is called by its number.
struct GroupedMesh {
  TetMesh mesh;
  Eigen::Matrix<int, 3, Eigen::Dynamic> triangles;  // mesh nodes, in either orientation
  std::vector<int> triangle_labels;
  std::map<std::string, int> volume_names;
  std::map<std::string, int> surface_names;
};

}  // namespace brainshift
