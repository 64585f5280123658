// SPDX-License-Identifier: GPL-3.0-or-later
// .ply files, ascii and binary little-endian: elements "vertex" (x, y, z) and "face" (a list of
// three vertex indices). All other elements and properties are skipped; without "face" the
// triangles are empty. Source: Greg Turk, "The PLY Polygon File Format". Private to the room:
// read_surface and read_surface_or_points of mesh_file.hpp call it and put the file's name in
// front of messages.
#pragma once

#include <string>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::io {

// From the whole file's bytes. Indices may lie outside the vertices: the caller checks.
// kUnreadable.
Result<TriangleSurface> parse_ply(const std::string& content);

}  // namespace brainshift::io
