// SPDX-License-Identifier: GPL-3.0-or-later
// Tetrahedra and surfaces with fields to files; mm RAS, and a VTK file says so (SPACE). A file is
// written to a temporary name, synced, renamed. kWriteFailed names the file; kInvalidArgument a
// field that does not fit.
#pragma once

#include <filesystem>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/io/geometry/node_field.hpp"

namespace brainshift::io {

// A VTK .vtu file, base64 and zlib.
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

// A surface with fields on its vertices, as .ply (binary, little-endian, float64; only fields of
// one row) or .vtp. kUnreadable for another extension.
Status write_surface(const std::filesystem::path& path, const TriangleSurface& surface,
                     const std::vector<NodeField>& vertex_fields = {});

}  // namespace brainshift::io
