// SPDX-License-Identifier: Apache-2.0
// BrainModel: the patient's geometry before surgery, with the node sets of the paper's section
// 2.6.
//
// Made once from a case (MRI, mask, tumour, craniotomy, pose). Everything later is derived from
// it. The four node sets are disjoint and together are exactly the nodes of the outer boundary:
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

// Labels of tetrahedra whose tissue the label map told (mesh.labels); no mesh file has such
// numbers. 0: brain, not told apart.
inline constexpr int kWhiteMatter = -2, kGreyMatter = -3, kCerebellumLabel = -8,
                     kBrainstemLabel = -16;

// Falx and tentorium: fixed sheets in slits of the mesh. Tissue on either side has nodes of its own
// there. They may leave the sheet and not pass it, by the penalty of contact with the skull; at the
// free edge of a slit both sides share their nodes. A node where two sheets meet is there twice.
struct Septa {
  std::vector<NodeIndex> slaves;
  Points normals = Points(3, 0);  // per slave: unit, from the sheet into its tissue
  double gap_mm = 0.0;            // between sheet and slave before surgery
  // The sheets as triangles between the nodes of each side, oriented out of its tissue.
  Eigen::Matrix<int, 3, Eigen::Dynamic> triangles = Eigen::Matrix<int, 3, Eigen::Dynamic>(3, 0);
};

struct BrainModel {
  std::string case_id;
  // Hash of mesh, sets and surfaces; two processes agree on a model if and only if these agree.
  std::string model_id;

  TetMesh mesh;
  // The brain's outer surface: 3 x t mesh node indices, oriented outwards. Slits and cavities are
  // not of it.
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

  Septa septa;
  // Wall of the ventricles, which are cavities of the mesh: oriented out of the tissue.
  Eigen::Matrix<int, 3, Eigen::Dynamic> ventricle_wall =
      Eigen::Matrix<int, 3, Eigen::Dynamic>(3, 0);

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
