// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces with fields to .ply and .vtp files; mm RAS. A .vtp says so (vtk_xml_writing.hpp).
#pragma once

#include <filesystem>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/io/geometry/node_field.hpp"

namespace brainshift::io {

// A surface with fields on its vertices, as .ply (binary, little-endian, float64; only fields of
// one row) or .vtp. kUnreadable for another extension, kWriteFailed, kInvalidArgument for a field
// that does not fit.
Status write_surface(const std::filesystem::path& path, const TriangleSurface& surface,
                     const std::vector<NodeField>& vertex_fields = {});

}  // namespace brainshift::io
