// SPDX-License-Identifier: GPL-3.0-or-later
// CaseInputs -> BrainModel: mesh, surfaces and the node sets of the paper's section 2.6.
#pragma once

#include <string>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/configuration/case_inputs.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/progress.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::anatomy {

// The node sets of the paper's section 2.6: which boundary nodes are open, held or in contact.

// The outer surface of the brain mesh. Column v of surface.vertices and normals belongs to mesh
// node node_of_vertex[v].
struct BrainSurface {
  TriangleSurface surface;
  Points normals;  // unit, outward
  std::vector<NodeIndex> node_of_vertex;
};
BrainSurface brain_surface_of(const TetMesh& mesh);

// Disjoint; together all boundary nodes. Depth of a point x is x . gravity_direction (mm).
struct NodeSets {
  std::vector<NodeIndex> craniotomy, brainstem, slaves, fixed;
  double fluid_plane_depth_mm = 0.0, slave_plane_depth_mm = 0.0;
};

// craniotomy  nodes inside the ellipse with the given full axes, in the tangent plane at the
//             surface point c nearest to craniotomy.centre_mm; at most 15 mm from that plane; with
//             a normal within 60 degrees of the plane's, which is the mean of the surface normals
//             within half the short axis of c
// brainstem   other nodes in the brainstem's sphere
// slaves      other nodes above the second plane: depth < fluid plane + contact.slave_depth_mm,
//             where the fluid plane passes through the lowest craniotomy node (the largest depth)
// fixed       the rest
//
// kEmptySet names the key: the craniotomy's centre is farther from the surface than half its long
// axis, or the craniotomy selects no node; the brainstem's sphere (of radius > 0) selects none;
// no slave; no fixed node.
// kInvalidArgument: long_axis_direction is perpendicular to the surface.
Result<NodeSets> select_node_sets(const BrainSurface& brain, const CaseConfig& config);

// Deterministic. An error is one sentence that names key and value.
//   kEmptySet         mask without component, a craniotomy that selects no node, no slave, no
//                     tumour voxel
//   kInvalidArgument  tumour outside the brain by more than kLargestCut_mm (brain_mesh.hpp);
//                     metres and millimetres mixed up in a given mesh, tumour or skull (by its
//                     extent); a given skull that is turned inside out in parts, lies farther than
//                     15 mm from the nodes that may touch it (median), or has one of them more than
//                     3 mm outside; inputs that given_inputs.hpp refuses
//   kDegenerateMesh   as make_brain_mesh
// notes (optional) receives what was made of the inputs that the user should know, a sentence each.
Result<BrainModel> build_brain_model(const CaseInputs& inputs, const Progress& progress = {},
                                     std::vector<std::string>* notes = nullptr);

}  // namespace brainshift::anatomy
