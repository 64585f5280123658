// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes and surfaces from files, by the extension of the name; everything in mm RAS. A VTK file
// whose array SPACE, or an STL, PLY or OBJ file whose heading or comment (SPACE=LPS, as 3D Slicer
// writes it) says LPS is turned into RAS; a file that says nothing is taken for RAS; kUnreadable
// names any other value.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/io/geometry/node_field.hpp"

namespace brainshift::io {

// Tetrahedra of a Gmsh .msh (2.2 and 4.1, ASCII and binary) or a VTK .vtu (ascii, base64 and
// appended, zlib or uncompressed). kUnreadable, naming types and counts: volumes of another type,
// or surfaces of one in a group. Lines and points do not count. Physical groups / a cell array
// named "label" become labels. Unreferenced nodes are dropped. Does not judge the elements: see
// geometry/mesh_quality.hpp.
Result<TetMesh> read_tet_mesh(const std::filesystem::path& path);

// The same with triangles and the names of physical groups (.msh), or triangles with their labels
// (.vtu). A triangle is dropped when one of its nodes belongs to no tetrahedron, or when its
// group has it already.
Result<GroupedMesh> read_grouped_mesh(const std::filesystem::path& path);

// Triangles of an .stl (ASCII, binary), .ply (ascii, little-endian), .obj or .vtp file. Coincident
// STL vertices are merged; vertices without a triangle are dropped.
Result<TriangleSurface> read_surface(const std::filesystem::path& path);

// The same, and points without triangles: a .ply without faces, or .xyz, .txt, .csv, .pts with the
// three coordinates of a point at the start of each line, or where a heading says (x,y,z or r,a,s
// or l,p,s, which is turned to RAS). Further columns, e.g. colours, are ignored, but for
// "defined": 0 leaves a point out. Triangles are then empty.
Result<TriangleSurface> read_surface_or_points(const std::filesystem::path& path);

// A VTU's mesh with all of its point arrays that are float or double, in file order. Keeps
// unreferenced nodes, so that node i is the file's point i. An array of three components is taken
// for vectors, which turn with the points.
Result<MeshWithFields> read_vtu(const std::filesystem::path& path);

}  // namespace brainshift::io
