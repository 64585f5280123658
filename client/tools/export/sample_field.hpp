// SPDX-License-Identifier: GPL-3.0-or-later
// The grid that an export is on, and the field on it.
#pragma once

#include <cstddef>

#include "client/tools/volume/field_grid.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/progress.hpp"
#include "common/io/fields/displacement_field.hpp"

namespace brainshift::client {

// The grid of an image. Errors of io::validate(VoxelGrid).
Result<io::VoxelGrid> grid_like(const VoxelImage& image);

// One around the brain: along the axes of RAS, the same spacing along all three, around the brain
// before and after u, with room for the taper outside of it. Errors of grid_around and
// io::validate(VoxelGrid).
Result<io::VoxelGrid> grid_around_brain(const TetMesh& mesh, const Points& u, double spacing_mm,
                                        const OutsideTaper& taper = {});

// The mesh's displacement u on the voxels of an image grid, in one of two directions.
//
//   modeling     v(x) =  u(x)          x undeformed
//   resampling   v(x) = -u(X)          x deformed, X the undeformed place with X + u(X) = x
//
// u is linear in a tetrahedron, so x -> x + u(x) maps every tetrahedron to the one with its nodes
// moved, and X is found exactly: x has the same barycentric weights w in the moved tetrahedron as X
// has in its own, v(x) = -sum_k w_k u_k. There is no iteration, and no tolerance but rounding.
//
// Outside of the brain, undeformed or deformed, v is that of the closest point of its surface times
// OutsideTaper::factor(distance). There the two directions are no longer each other's inverse.
//
// With the field come, on the same voxels:
//   sd_mm      standard deviation, barycentric; 0 outside of the brain
//   known      how much the data say, 0 to 1, barycentric; 0 outside of the brain
//   jacobian   det(I + grad u): volume after over volume before, of the element that holds the
//              voxel. Below 1 compressed, at 0 and below folded. 1 outside of the brain

// One per tetrahedron: det(I + grad u). Precondition: check_mesh(mesh), a column of u per node.
VecX volume_ratios(const TetMesh& mesh, const Points& u);

// Of an estimate: one value per node each, or none (Estimate::sd_mm and Estimate::known).
struct Uncertainty {
  VecX sd_mm = {}, known = {};
};

struct FieldSamples {
  io::DisplacementField field;
  io::ScalarVolume sd_mm, known;  // no values where the estimate has none
  io::ScalarVolume jacobian;
  std::size_t voxels_inside = 0;  // in the brain: undeformed for modeling, deformed for resampling
  double largest_mm = 0.0;        // of the field's vectors
};

// u: 3 x n, mm. Every slice of the grid is shared out in fixed parts: the
// result depends on no timing. Stages of `progress`: "sampling the field".
// Errors of validate(grid) and validate(taper). kInvalidArgument: resampling, and u turns a
// tetrahedron inside out, so that there is no inverse (the sentence says how many). kNotFinite: u.
// Precondition: check_mesh(mesh), and as many columns as nodes.
Result<FieldSamples> sample_field(const TetMesh& mesh, const Points& u, const Uncertainty& of,
                                  const io::VoxelGrid& grid, io::FieldDirection direction,
                                  const OutsideTaper& taper = {}, const Progress& progress = {});

}  // namespace brainshift::client
