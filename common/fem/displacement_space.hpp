// SPDX-License-Identifier: GPL-3.0-or-later
// DisplacementSpace: continuous displacements on tetrahedra, linear (P1) or quadratic (P2,
// straight edges).
//
//   P1   N_k = l_k                                    4 nodes: the vertices
//   P2   N_k = l_k (2 l_k - 1), N_ab = 4 l_a l_b      10 nodes: vertices, then edge midpoints
//
// l_k: barycentric coordinates. Order of nodes: the mesh's vertices with their own indices, then
// one node per edge, edges in increasing order of (lower, higher) vertex. Order in an element:
// vertices 0..3, then edges 01 12 02 03 13 23 (VTK's quadratic tetrahedron). Order in a face:
// vertices 0..2, then edges 01 12 20.
// P1 locks towards nu = 0.5; P2 does not (docs/decisions/0010-locking-free-element.md).
#pragma once

#include <Eigen/Core>

#include <array>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/fem/dof_map.hpp"

namespace brainshift::fem {

enum class Element { kP1, kP2 };

// Largest number of nodes of an element and of a face.
inline constexpr int kMaxElementNodes = 10;
inline constexpr int kMaxFaceNodes = 6;
// A column per node; at most kMaxElementNodes of them, so nothing is allocated.
using ShapeValues = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxElementNodes, 1>;
using ShapeGradients = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxElementNodes>;

struct DisplacementSpace {
  Element element = Element::kP1;
  TetMesh mesh;
  Points nodes;                           // 3 x n, mm
  Eigen::MatrixXi elements;               // 4 or 10 x m
  std::vector<std::array<int, 2>> edges;  // P2: vertices of node num_vertices() + e; sorted

  int num_nodes() const { return static_cast<int>(nodes.cols()); }
  int num_vertices() const { return mesh.num_nodes(); }
  int num_elements() const { return static_cast<int>(elements.cols()); }
  int nodes_per_element() const { return static_cast<int>(elements.rows()); }
  int nodes_per_face() const { return element == Element::kP1 ? 3 : 6; }
};

// Precondition: geometry::check_mesh(mesh).
DisplacementSpace make_space(TetMesh mesh, Element element);

// Nodes of a face with these vertices; -1 where two vertices share no edge.
std::array<int, kMaxFaceNodes> face_nodes(const DisplacementSpace& space,
                                          const Eigen::Vector3i& vertices);

// N_k at a barycentric point, and their gradients in mm^-1 (one column each). vertex_gradients:
// TetGeometry::gradients.
ShapeValues shape_values(Element element, const Eigen::Vector4d& l);
ShapeGradients shape_gradients(Element element, const Eigen::Matrix<double, 3, 4>& vertex_gradients,
                               const Eigen::Vector4d& l);
// N_k of a face.
Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxFaceNodes, 1> face_shape_values(
    Element element, const Eigen::Vector3d& l);

// Barycentric points and weights (sum 1) of quadrature rules.
struct TetPoint {
  Eigen::Vector4d l;
  double weight;
};
struct TrianglePoint {
  Eigen::Vector3d l;
  double weight;
};
// Exact for the stiffness of an element: degree 0 (P1) or 2 (P2).
const std::vector<TetPoint>& stiffness_rule(Element element);
// Degree 5, 14 points (Walkington 2000): loads and error norms.
const std::vector<TetPoint>& fine_tet_rule();
// Degree 2, 3 points; degree 4, 6 points (Dunavant 1985).
const std::vector<TrianglePoint>& coarse_triangle_rule();
const std::vector<TrianglePoint>& fine_triangle_rule();

// DisplacementConstraints: prescribed displacements n . u = value, gathered node by node, along
// any number of directions.
//
// The directions of a node are made orthonormal one after the other. They become the first axes
// of its frame and are eliminated exactly (dof_map.hpp). Values enter as a lift: u = T q + lift,
// so that T^T K T q = T^T (f - K lift). A node whose directions are coordinate axes keeps the
// identity frame.
struct ConstrainedDofs {
  DofMap dofs;
  Points lift;  // 3 x n, mm; zero along free directions
};

class DisplacementConstraints {
 public:
  explicit DisplacementConstraints(int num_nodes);

  // n . u = value at a node; n of length one. Messages name `source`. A direction that the
  // earlier directions of the node span must agree with them: otherwise kInvalidArgument, naming
  // both sources.
  Status add(NodeIndex node, const Vec3& direction, double value, const std::string& source);
  Status add_all(NodeIndex node, const Vec3& value, const std::string& source);

  // Orthonormal constrained directions of a node.
  std::vector<Vec3> directions(NodeIndex node) const;
  ConstrainedDofs build() const;

 private:
  struct Direction {
    Vec3 axis;
    double value;
    int source;
  };
  std::vector<std::vector<Direction>> of_node_;
  std::vector<std::string> sources_;
};

}  // namespace brainshift::fem
