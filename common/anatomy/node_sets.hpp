// SPDX-License-Identifier: GPL-3.0-or-later
// Which boundary nodes are open, held or in contact: the node sets of the paper's section 2.6.
#pragma once

#include <vector>

#include "common/values/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::anatomy {

// The boundary of a mesh: column v of surface.vertices and normals belongs to mesh node node_of_vertex[v].
struct Boundary {
  TriangleSurface surface;
  Points normals;  // unit, outward
  std::vector<NodeIndex> node_of_vertex;
};
Boundary boundary_of(const TetMesh& mesh);

// Disjoint; together all boundary nodes. Depth of a point x is x . gravity_direction (mm).
struct NodeSets {
  std::vector<NodeIndex> craniotomy;
  std::vector<NodeIndex> brainstem;
  std::vector<NodeIndex> slaves;
  std::vector<NodeIndex> fixed;
  double fluid_plane_depth_mm = 0.0;
  double slave_plane_depth_mm = 0.0;
};

// craniotomy  inside the ellipse with the given full axes in the tangent plane at the boundary point c
//             nearest to craniotomy.centre_mm, at most 15 mm from that plane, normal within 60 degrees of
//             the plane's. The plane's normal is the mean of the boundary normals within half the short
//             axis of c.
// brainstem   other nodes in the brainstem's sphere
// slaves      other nodes above the second plane: depth < fluid plane + contact.slave_depth_mm, where the
//             fluid plane passes through the lowest craniotomy node (the largest depth)
// fixed       the rest
//
// kEmptySet names the key: the craniotomy's centre is farther from the boundary than half its long axis,
// or selects no node; the brainstem's sphere (of radius > 0) selects none; no slave; no fixed node.
// kInvalidArgument: long_axis_direction is perpendicular to the surface.
Result<NodeSets> select_node_sets(const Boundary& boundary, const CaseConfig& config);

}  // namespace brainshift::anatomy
