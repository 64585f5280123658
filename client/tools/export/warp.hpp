// SPDX-License-Identifier: GPL-3.0-or-later
// What a displacement moves: images and surfaces of the undeformed brain as the deformed brain
// looks.
#pragma once

#include <vector>

#include "client/tools/export/sample_field.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/io/fields/displacement_field.hpp"
#include "common/io/geometry/node_field.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

// Every voxel x of the field's grid asks the image at x + v(x), v the resampling field.
//
// Linear interpolation. A place up to half a voxel outside of the image takes the border's value,
// farther out it is 0: what ITK and its kin do. A voxel of the image that is not finite counts as
// 0. Errors of validate(field). kInvalidArgument: a field of direction modeling, or an image that
// no voxel of the field's grid asks for.
Result<io::ScalarVolume> warp_image(const VoxelImage& image, const io::DisplacementField& field);

// Surfaces of a model as the displacement moves them, with what moved them on their vertices.
//
//   vertices         x + u(x), RAS, mm
//   displacement_mm  u(x), three components; moves undeformed to deformed
//   sd_mm            standard deviation of u(x)
//   known            how much the data say of it, 0 to 1; both are left out where the update has
//   none
struct DeformedSurface {
  TriangleSurface surface;
  std::vector<io::NodeField> vertex_fields;
};

// u: 3 x nodes of the mesh.
// The tumour's vertices lie anywhere in the mesh: u is interpolated there (outside of the mesh: at
// its closest point).
DeformedSurface deformed_tumour(const BrainModel& model, const Points& u, const Uncertainty& of);
// Triangles of the mesh's nodes, at least one: its boundary, brainstem included; the wall of the
// ventricles.
DeformedSurface deformed_triangles(const BrainModel& model,
                                   const Eigen::Matrix<int, 3, Eigen::Dynamic>& triangles,
                                   const Points& u, const Uncertainty& of);

}  // namespace brainshift::client
