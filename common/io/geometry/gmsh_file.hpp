// SPDX-License-Identifier: GPL-3.0-or-later
// Gmsh .msh files, 2.2 and 4.1, ASCII and binary. Source: Gmsh reference manual, "MSH file
// format". Private to the room: mesh_file.hpp calls it and puts the file's name in front of
// messages.
#pragma once

#include <string>

#include "common/core/error.hpp"
#include "common/core/grouped_mesh.hpp"

namespace brainshift::io {

// From the whole file's bytes; keeps unreferenced nodes. kUnreadable.
Result<GroupedMesh> parse_gmsh(const std::string& content);

}  // namespace brainshift::io
