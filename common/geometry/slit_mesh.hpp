// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh opened along facets inside it, and with cavities: tetrahedra taken out.
#pragma once

#include <array>
#include <vector>

#include "common/core/mesh.hpp"

namespace brainshift::geometry {

// Facets of a mesh, by their three nodes in increasing order.
using Facets = std::vector<std::array<int, 3>>;

struct SlitMesh {
  TetMesh mesh;  // tetrahedra that stay, in their order, with their labels; new nodes are the last
  // Per node of the mesh before, its nodes now: several where facets part its tetrahedra, none
  // where all of these went.
  std::vector<std::vector<NodeIndex>> copies;
  // boundary_triangles of the mesh before, with the nodes of now: without slits and cavities.
  Eigen::Matrix<int, 3, Eigen::Dynamic> outer;
  // Between a tetrahedron that stays and one that went: out of the first.
  Eigen::Matrix<int, 3, Eigen::Dynamic> wall;
  // The facets that are open, on either side: out of its tissue.
  Eigen::Matrix<int, 3, Eigen::Dynamic> sheets;
  // Nodes on either side of a slit, and the unit normals there into the tissue of that side: the
  // area-weighted mean over the facets of one group. A node of two groups is there twice; nodes of
  // the free edge, which both sides share, are not there.
  std::vector<NodeIndex> side_nodes;
  Points side_normals;
};

// taken: per tetrahedron whether it goes; what is then cut off from the largest part that faces
// join goes too. group_of: per facet. Facets that do not lie between two tetrahedra that stay open
// nothing.
SlitMesh cut_mesh(const TetMesh& mesh, const std::vector<char>& taken, const Facets& facets,
                  const std::vector<int>& group_of);

}  // namespace brainshift::geometry
