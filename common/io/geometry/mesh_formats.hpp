// SPDX-License-Identifier: GPL-3.0-or-later
// The formats of meshes and surfaces, each from the bytes of a whole file. Private to the room:
// mesh_file.cpp chooses one by the file's extension and puts the file's name in front of messages.
// All fail with kUnreadable. Indices may lie outside the nodes or vertices: the caller checks.
#pragma once

#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/io/geometry/node_field.hpp"

namespace brainshift::io {

// Gmsh .msh, 2.2 and 4.1, ASCII and binary. Keeps unreferenced nodes. Source: Gmsh reference
// manual, "MSH file format".
Result<GroupedMesh> parse_gmsh(const std::string& content);

// VTK's XML container (.vtu, .vtp): ascii, binary (base64) and appended (raw or base64) arrays;
// zlib-compressed or not; header_type UInt32 or UInt64; either byte order. Messages name the
// array. Source: VTK user's guide, "VTK XML file formats". All keep unreferenced nodes.
Result<MeshWithFields> parse_vtu(std::string content);
// Tetrahedra and triangles; labels are numbers, a VTU names nothing.
Result<GroupedMesh> parse_grouped_vtu(std::string content);
Result<TriangleSurface> parse_vtp(std::string content);

// .stl, ASCII and binary. STL stores three corners per triangle; equal corners become one vertex.
Result<TriangleSurface> parse_stl(const std::string& content);
// .ply, ascii and binary little-endian: elements "vertex" (x, y, z) and "face" (a list of three
// vertex indices). All other elements and properties are skipped; without "face" the triangles are
// empty. Source: Greg Turk, "The PLY Polygon File Format".
Result<TriangleSurface> parse_ply(const std::string& content);
// Wavefront .obj: `v x y z` and triangular `f a b c` lines, where a vertex may carry texture and
// normal indices (a/b/c) and count from the end (-1 is the latest vertex). Everything else is
// skipped. Messages name the line.
Result<TriangleSurface> parse_obj(const std::string& content);
// Points in plain text, without triangles: x, y, z at the start of each line, numbers between
// blanks, tabs, commas or semicolons. A first line of words is a heading, which must name the
// columns (files/table.hpp); empty lines and those that begin with '#' or "//" are skipped, but
// for such a heading and for SPACE=LPS in them. Messages name the line.
Result<TriangleSurface> parse_xyz(const std::string& content);

// Numbers of a list, one column after the other.
template <int Rows, typename T>
Eigen::Matrix<T, Rows, Eigen::Dynamic> as_columns(const std::vector<T>& numbers) {
  return Eigen::Map<const Eigen::Matrix<T, Rows, Eigen::Dynamic>>(
      numbers.data(), Rows, static_cast<Eigen::Index>(numbers.size() / Rows));
}

}  // namespace brainshift::io
