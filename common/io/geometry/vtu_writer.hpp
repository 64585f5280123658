// SPDX-License-Identifier: GPL-3.0-or-later
// Tetrahedra with fields to a VTK .vtu file; mm RAS. The file says so (vtk_xml_writing.hpp).
#pragma once

#include <filesystem>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/io/geometry/node_field.hpp"

namespace brainshift::io {

// Base64 and zlib. Written to a temporary name, synced, renamed. kWriteFailed names the file;
// kInvalidArgument names a field that does not fit.
Status write_vtu(const std::filesystem::path& path, const TetMesh& mesh,
                 const std::vector<NodeField>& node_fields);

// The same for linear (4 rows) or quadratic (10 rows, edges 01 12 02 03 13 23) tetrahedra, with
// fields on the cells.
struct ElementGrid {
  Points nodes;
  Eigen::MatrixXi elements;
  std::vector<int> labels;  // one per element, or none
};
Status write_vtu(const std::filesystem::path& path, const ElementGrid& grid,
                 const std::vector<NodeField>& node_fields,
                 const std::vector<NodeField>& cell_fields);

}  // namespace brainshift::io
