// SPDX-License-Identifier: GPL-3.0-or-later
// Point clouds in plain text: x, y, z at the start of each line; a first line of words is a
// heading. Private to the room: read_surface and read_surface_or_points of mesh_file.hpp call it
// and put the file's name in front of messages.
#pragma once

#include <string>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::io {

// From the whole file's bytes; without triangles. kUnreadable names the line or point.
Result<TriangleSurface> parse_xyz(const std::string& content);

}  // namespace brainshift::io
