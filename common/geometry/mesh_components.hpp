// SPDX-License-Identifier: GPL-3.0-or-later
// Components of a tetrahedral mesh that are connected by faces. Parts that share only a node or
// an edge could turn about it like a hinge: for elasticity they are separate bodies.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace brainshift::geometry {

struct TetComponents {
  std::vector<int> component_of_tet;  // numbered in order of their lowest tetrahedron
  std::vector<int> sizes;             // tetrahedra per component
};

// Precondition: node indices are >= 0.
TetComponents tet_components(const Eigen::Matrix<int, 4, Eigen::Dynamic>& tets);

}  // namespace brainshift::geometry
