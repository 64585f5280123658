// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes and surfaces from and to files; everything in mm RAS.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/grouped_mesh.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::io {

// Tetrahedra of a Gmsh .msh (2.2 and 4.1, ASCII and binary) or a VTK .vtu (ascii, base64 and appended,
// zlib or uncompressed). Other element types are ignored, unless no tetrahedron is left (kUnreadable).
// Physical groups / a cell array named "label" become labels. Unreferenced nodes are dropped.
// Does not judge the elements: see geometry/mesh_quality.hpp.
Result<TetMesh> read_tet_mesh(const std::filesystem::path& path);

// The same with triangles and the names of physical groups (.msh), or triangles with their labels (.vtu). A triangle of
// nodes that no tetrahedron has is dropped.
Result<GroupedMesh> read_grouped_mesh(const std::filesystem::path& path);

// Triangles of an .stl (ASCII, binary), .ply (ascii, little-endian), .obj or .vtp file. Coincident STL
// vertices are merged.
Result<TriangleSurface> read_surface(const std::filesystem::path& path);

// The same, and points without triangles: a .ply without faces, or .xyz, .txt, .csv, .pts with the three coordinates
// of a point at the start of each line (further columns, e.g. colours, are ignored; a first line of words is a
// heading). Triangles are then empty.
Result<TriangleSurface> read_surface_or_points(const std::filesystem::path& path);

// A named field on the nodes: `values` is 1 x n or 3 x n.
struct NodeField {
  std::string name;
  Eigen::MatrixXd values;
};

// VTU, base64 zlib-compressed; written to a temporary name, synced, renamed. kWriteFailed names the file.
Status write_vtu(const std::filesystem::path& path, const TetMesh& mesh,
                 const std::vector<NodeField>& node_fields);

// The same for linear (4 rows) or quadratic (10 rows, edges 01 12 02 03 13 23) tetrahedra, with fields on the cells.
struct ElementGrid {
  Points nodes;
  Eigen::MatrixXi elements;
  std::vector<int> labels;  // one per element, or none
};
Status write_vtu(const std::filesystem::path& path, const ElementGrid& grid,
                 const std::vector<NodeField>& node_fields,
                 const std::vector<NodeField>& cell_fields);

// A surface with fields on its vertices, as .ply (binary, little-endian, float64; only fields of one row) or .vtp.
// kUnreadable for another extension, kWriteFailed, kInvalidArgument for a field that does not fit.
Status write_surface(const std::filesystem::path& path, const TriangleSurface& surface,
                     const std::vector<NodeField>& vertex_fields = {});

// A VTU's mesh with all of its point arrays that are float or double, in file order. Keeps unreferenced
// nodes, so that node i is the file's point i.
struct MeshWithFields {
  TetMesh mesh;
  std::vector<NodeField> node_fields;
};
Result<MeshWithFields> read_vtu(const std::filesystem::path& path);

}  // namespace brainshift::io
