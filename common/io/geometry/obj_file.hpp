// SPDX-License-Identifier: GPL-3.0-or-later
// Wavefront .obj files: `v x y z` and triangular `f a b c` lines, where a vertex may carry
// texture and normal indices (a/b/c) and count from the end (-1 is the latest vertex). Everything
// else is skipped. Private to the room: read_surface and read_surface_or_points of mesh_file.hpp
// call it and put the file's name in front of messages.
#pragma once

#include <string>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::io {

// From the whole file's bytes. Indices may lie beyond the vertices: the caller checks. kUnreadable
// names the line.
Result<TriangleSurface> parse_obj(const std::string& content);

}  // namespace brainshift::io
