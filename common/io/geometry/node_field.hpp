// SPDX-License-Identifier: GPL-3.0-or-later
// Named fields on the nodes or cells of a mesh, as mesh files carry them.
#pragma once

#include <string>
#include <vector>

#include "common/core/mesh.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

struct NodeField {
  std::string name;
  Eigen::MatrixXd values;  // 1 x n or 3 x n
};

struct MeshWithFields {
  TetMesh mesh;
  std::vector<NodeField> node_fields;
};

}  // namespace brainshift::io
