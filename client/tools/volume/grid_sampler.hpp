// SPDX-License-Identifier: GPL-3.0-or-later
// GridSampler: a displacement field of the mesh's nodes, on the voxels of a grid.
//
//   inside the brain    U(x) = sum_k w_k(x) u(node_k(x))     barycentric, as the mesh interpolates
//   outside             U(x) = taper(d) U(closest point of the brain's surface)
//   near the rim        times fade(distance to the rim)
//   in the rim          0
//
// u moves undeformed points to their deformed places (modelling direction); x is undeformed; RAS,
// mm. Indices and weights of every voxel are computed once; sampling is a gather that allocates
// nothing, and costs nothing for voxels that are always zero.
//
// A viewer interpolates trilinearly between voxels, the mesh linearly in its tetrahedra.
// interpolation_error_mm says how far the two are apart. It belongs beside every field.
//
// fade: a grid that ends in the brain would end in a step from u to 0, which tears an image and has
// no inverse. Over the last fade_mm before the rim the field therefore falls to zero like
// (1 - cos(pi d / fade_mm)) / 2. There it is neither u nor 0; interior() leaves these voxels out.
#pragma once

#include <cstdint>
#include <vector>

#include "client/tools/volume/field_grid.hpp"
#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::client {

struct SamplerOptions {
  OutsideTaper taper = {};
  double fade_mm = 0.0;  // 0 to 1000; 0: the rim alone is zero
};

class GridSampler {
 public:
  // Errors of validate(grid) and validate(taper); kInvalidArgument: fade_mm. kEmptySet: the mesh
  // has no tetrahedron.
  static Result<GridSampler> build(const geometry::TetLocator& mesh, const FieldGrid& grid,
                                   const SamplerOptions& options = {});

  const FieldGrid& grid() const { return grid_; }
  // Nodes of which a voxel or the interpolation error depends, ascending: all that must be known.
  const std::vector<NodeIndex>& nodes_used() const { return nodes_used_; }
  // Mesh nodes that a viewer's interpolation must reproduce, ascending: those with no voxel of the
  // fade or the rim among the eight around them.
  const std::vector<NodeIndex>& interior() const { return interior_; }

  // u: 3 x nodes of the mesh, mm. xyz: 3 * grid().num_voxels() floats, the vector of a voxel in one
  // piece. Precondition: the columns of nodes_used() are finite.
  void sample(const Points& u, float* xyz) const;
  // values: one per mesh node. out: one float per voxel; 0 outside of the brain and in the rim; not
  // faded.
  void sample_scalar(const VecX& values, float* out) const;

  // The largest |trilinear(xyz)(x_node) - u_node| over interior(), mm; 0 without such a node.
  // xyz: what sample(u, .) wrote.
  double interpolation_error_mm(const Points& u, const float* xyz) const;

 private:
  // Of one voxel that is not always zero.
  struct Gather {
    std::uint32_t voxel = 0;
    std::int32_t nodes[4] = {0, 0, 0, 0};
    float weights[4] = {0, 0, 0, 0};  // barycentric
    float scale = 1.0F;               // taper times fade
  };
  GridSampler() = default;
  void find_gathers(const geometry::TetLocator& mesh, const SamplerOptions& options);
  void find_interior(const geometry::TetLocator& mesh, double fade_mm);
  void find_nodes_used();

  FieldGrid grid_;
  int mesh_nodes_ = 0;
  std::vector<Gather> inside_;   // voxels in the brain, ascending
  std::vector<Gather> outside_;  // voxels outside of it, ascending
  std::vector<NodeIndex> nodes_used_;
  std::vector<NodeIndex> interior_;
  Points interior_mm_;  // their places
};

}  // namespace brainshift::client
