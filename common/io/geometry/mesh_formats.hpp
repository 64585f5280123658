// SPDX-License-Identifier: GPL-3.0-or-later
// One parser per mesh format, from the whole file's bytes; private to io. Messages do not name the file:
// mesh_file.cpp puts it in front. All fail with kUnreadable.
#pragma once

#include <filesystem>
#include <string>

#include "common/core/error.hpp"
#include "common/core/grouped_mesh.hpp"
#include "common/core/mesh.hpp"
#include "common/io/geometry/mesh_file.hpp"

namespace brainshift::io {

// Gmsh reference manual, "MSH file format": 2.2 and 4.1. Keeps unreferenced nodes.
Result<GroupedMesh> parse_gmsh(const std::string& content);
// VTK XML. Keeps unreferenced nodes. Fields are decoded on request.
Result<MeshWithFields> parse_vtu(std::string content, bool with_fields);
// Tetrahedra and triangles; labels are numbers, a VTU names nothing.
Result<GroupedMesh> parse_grouped_vtu(std::string content);
Result<TriangleSurface> parse_vtp(std::string content);
Result<TriangleSurface> parse_stl(const std::string& content);
Result<TriangleSurface> parse_ply(const std::string& content);
Result<TriangleSurface> parse_obj(const std::string& content);
// Points only: three coordinates at the start of each line.
Result<TriangleSurface> parse_xyz(const std::string& content);

// Lower-case, with its dot.
std::string lower_extension(const std::filesystem::path& path);

}  // namespace brainshift::io
