// SPDX-License-Identifier: Apache-2.0
// A tetrahedral mesh with what its file calls its parts.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/core/mesh.hpp"

namespace brainshift {

// Volumes are the labels of mesh.labels; triangles carry a label of their own (0: none) and may be listed once per
// group. Names map to labels; a label without a name is called by its number.
struct GroupedMesh {
  TetMesh mesh;
  Eigen::Matrix<int, 3, Eigen::Dynamic> triangles;  // mesh nodes, in either orientation
  std::vector<int> triangle_labels;
  std::map<std::string, int> volume_names;
  std::map<std::string, int> surface_names;
};

}  // namespace brainshift
