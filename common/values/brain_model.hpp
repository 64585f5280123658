// SPDX-License-Identifier: Apache-2.0
// BrainModel: the patient's geometry before surgery, with the node sets of the paper's section
// 2.6.
//
// Made once from a case (MRI, mask, tumour, craniotomy, pose). Everything later is derived from
// it. The four node sets are disjoint and together are exactly the boundary nodes:
//   craniotomy, brainstem  stress-free
//   slaves                 above the second plane; may separate from or touch the skull (contact),
//                          or are treated like `fixed` under the fixed boundary condition
//   fixed                  fixed in the normal direction, free tangentially
#pragma once

#include <string>
#include <vector>

#include "common/core/mesh.hpp"
#include "common/core/types.hpp"
#include "common/values/distance_grid.hpp"

namespace brainshift {

struct BrainModel {
  std::string case_id;
  // Hash of mesh, sets and surfaces; two processes agree on a model if and only if these agree.
  std::string model_id;

  TetMesh mesh;
  // Boundary of the mesh: 3 x t mesh node indices, oriented outwards.
  Eigen::Matrix<int, 3, Eigen::Dynamic> boundary_triangles;
  // Inner surface of the skull (master surface); outward with respect to the brain.
  TriangleSurface skull;
  // Undeformed tumour surface.
  TriangleSurface tumour;
  // Signed distance to the tumour surface, for fast alignment. May be empty. It is derived from
  // `tumour`, so it does not enter model_id.
  DistanceGrid tumour_distance;

  std::vector<NodeIndex> craniotomy;
  std::vector<NodeIndex> brainstem;
  std::vector<NodeIndex> slaves;
  std::vector<NodeIndex> fixed;

  // Unit vector along gravity, RAS.
  Vec3 gravity_direction = Vec3(0, -1, 0);
  // Depth of a point: x . gravity_direction. The reference fluid plane is depth ==
  // fluid_plane_depth_mm and passes through the lowest craniotomy node; above it depth is
  // smaller.
  double fluid_plane_depth_mm = 0.0;
  // The second plane, deeper by the case's slave depth. Boundary nodes above it are slaves.
  double slave_plane_depth_mm = 0.0;
};

}  // namespace brainshift
