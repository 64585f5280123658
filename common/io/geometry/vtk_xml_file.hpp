// SPDX-License-Identifier: GPL-3.0-or-later
// .vtu and .vtp files: what the arrays of a VTK XML file mean. Private to the room: mesh_file.hpp
// calls it and puts the file's name in front of messages.
#pragma once

#include <string>

#include "common/core/error.hpp"
#include "common/core/grouped_mesh.hpp"
#include "common/core/mesh.hpp"
#include "common/io/geometry/node_field.hpp"

namespace brainshift::io {

// From the whole file's bytes. All keep unreferenced nodes and fail with kUnreadable.
// Fields are decoded on request.
Result<MeshWithFields> parse_vtu(std::string content, bool with_fields);
// Tetrahedra and triangles; labels are numbers, a VTU names nothing.
Result<GroupedMesh> parse_grouped_vtu(std::string content);
Result<TriangleSurface> parse_vtp(std::string content);

}  // namespace brainshift::io
