// SPDX-License-Identifier: GPL-3.0-or-later
// SurfacePatch: a surface that moves with the mesh, as an instrument sees it: the cortex under the
// craniotomy, or the boundary of the tumour.
//
//   vertex v moves by  sum_i weights(i, v) u(nodes[i])
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "common/core/mesh.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::registration {

struct SurfacePatch {
  std::vector<NodeIndex> nodes;  // of the mesh that move the surface, ascending
  TriangleSurface surface;       // undeformed, outward
  // nodes x vertices, columns of sum 1: 3 x nodes displacements times it are those of the vertices.
  Eigen::SparseMatrix<double> weights;
};

// Boundary triangles between three craniotomy nodes; no triangle when there are none. Vertex i is
// nodes[i].
SurfacePatch craniotomy_patch(const BrainModel& model);

// The tumour's surface, whose vertices are points inside tetrahedra. A vertex outside the mesh
// moves as the closest point of the mesh does. Precondition: the mesh has a tetrahedron.
SurfacePatch tumour_patch(const BrainModel& model);

}  // namespace brainshift::registration
