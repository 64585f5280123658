// SPDX-License-Identifier: GPL-3.0-or-later
// An image of the undeformed brain as the deformed brain looks: every voxel x of the field's grid
// asks the image at x + v(x), v the resampling field.
//
// Linear interpolation. A place up to half a voxel outside of the image takes the border's value,
// farther out it is 0: what ITK and its kin do. A voxel of the image that is not finite counts as
// 0.
#pragma once

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/io/fields/displacement_field.hpp"

namespace brainshift::client {

// Errors of validate(field). kInvalidArgument: a field of direction modeling, or an image that no
// voxel of the field's grid asks for.
Result<io::ScalarVolume> warp_image(const VoxelImage& image, const io::DisplacementField& field);

}  // namespace brainshift::client
