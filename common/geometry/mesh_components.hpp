// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of a tetrahedral mesh that hang together by faces. Parts that only share a node or an edge would
// turn about it like a hinge: for elasticity they are separate bodies.
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
