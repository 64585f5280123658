// SPDX-License-Identifier: GPL-3.0-or-later
// The check that a tetrahedral mesh can carry a finite-element model.
#pragma once

#include <Eigen/Core>

#include <array>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::geometry {

// mm^3, negative for an inverted tetrahedron.
double tet_volume(const TetMesh& mesh, int tet);

// The faces of all tetrahedra in the order of their nodes: a face between two of them stands there
// twice, one after the other.
struct MeshFace {
  std::array<int, 3> nodes;  // increasing
  int tet;
};
std::vector<MeshFace> sorted_faces(const Eigen::Matrix<int, 4, Eigen::Dynamic>& tets);

// Components of a tetrahedral mesh that are connected by faces. Parts that share only a node or
// an edge could turn about it like a hinge: for elasticity they are separate bodies.
struct TetComponents {
  std::vector<int> component_of_tet;  // numbered in order of their lowest tetrahedron
  std::vector<int> sizes;             // tetrahedra per component
};

// walls: faces that join nothing, by their nodes in increasing order, sorted. Precondition: node
// indices are >= 0.
TetComponents tet_components(const Eigen::Matrix<int, 4, Eigen::Dynamic>& tets,
                             const std::vector<std::array<int, 3>>& walls = {});

// Ok, or one sentence that names the first offender.
//   kNotFinite        a node
//   kInvalidArgument  a node index out of range
//   kDegenerateMesh   an inverted or flat tetrahedron, with its volume; two tetrahedra on one side
//                     of a face (one of them twice, or both overlap); several components; unused
//                     nodes. Flat means volume < 1e-9 x (longest edge)^3.
//   kEmptySet         no tetrahedron
Status check_mesh(const TetMesh& mesh);

}  // namespace brainshift::geometry
