// SPDX-License-Identifier: GPL-3.0-or-later
// The grid that an export is on: that of an image, or one of its own around the brain.
#pragma once

#include "client/tools/volume/outside_taper.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/io/fields/displacement_field.hpp"

namespace brainshift::client {

// Errors of io::validate(VoxelGrid).
Result<io::VoxelGrid> grid_like(const VoxelImage& image);

// Along the axes of RAS, the same spacing along all three, around the brain before and after u,
// with room for the taper outside of it. Errors of grid_around
// (client/tools/volume/field_grid.hpp) and io::validate(VoxelGrid).
Result<io::VoxelGrid> grid_around_brain(const TetMesh& mesh, const Points& u, double spacing_mm,
                                        const OutsideTaper& taper = {});

}  // namespace brainshift::client
