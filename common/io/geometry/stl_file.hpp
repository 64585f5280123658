// SPDX-License-Identifier: GPL-3.0-or-later
// .stl files, ASCII and binary. STL stores three corners per triangle; equal corners become one
// vertex. Private to the room: read_surface and read_surface_or_points of mesh_file.hpp call it
// and put the file's name in front of messages.
#pragma once

#include <string>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::io {

// From the whole file's bytes. kUnreadable.
Result<TriangleSurface> parse_stl(const std::string& content);

}  // namespace brainshift::io
