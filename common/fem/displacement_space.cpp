// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/displacement_space.hpp"

#include <algorithm>
#include <utility>

namespace brainshift::fem {
namespace {

constexpr std::array<std::array<int, 2>, 6> kTetEdges = {
    {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};
constexpr std::array<std::array<int, 2>, 3> kFaceEdges = {{{0, 1}, {1, 2}, {2, 0}}};

std::array<int, 2> edge_between(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

// Node in the middle of an edge, -1 when the edge does not exist.
int edge_node(const DisplacementSpace& space, int a, int b) {
  const std::array<int, 2> edge = edge_between(a, b);
  const auto found = std::lower_bound(space.edges.begin(), space.edges.end(), edge);
  if (found == space.edges.end() || *found != edge) return -1;
  return space.num_vertices() + static_cast<int>(found - space.edges.begin());
}

std::vector<std::array<int, 2>> sorted_edges(const TetMesh& mesh) {
  std::vector<std::array<int, 2>> edges;
  edges.reserve(6 * static_cast<std::size_t>(mesh.num_tets()));
  for (int t = 0; t < mesh.num_tets(); ++t) {
    for (const auto& [a, b] : kTetEdges) {
      edges.push_back(edge_between(mesh.tets(a, t), mesh.tets(b, t)));
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

// All points that permute (a, b, b, b).
void add_vertex_points(std::vector<TetPoint>& rule, double b, double weight) {
  for (int k = 0; k < 4; ++k) {
    Eigen::Vector4d l = Eigen::Vector4d::Constant(b);
    l[k] = 1.0 - 3.0 * b;
    rule.push_back({l, weight});
  }
}

// All points that permute (a, a, 1/2 - a, 1/2 - a).
void add_edge_points(std::vector<TetPoint>& rule, double a, double weight) {
  for (const auto& [i, j] : kTetEdges) {
    Eigen::Vector4d l = Eigen::Vector4d::Constant(0.5 - a);
    l[i] = l[j] = a;
    rule.push_back({l, weight});
  }
}

void add_triangle_points(std::vector<TrianglePoint>& rule, double b, double weight) {
  for (int k = 0; k < 3; ++k) {
    Eigen::Vector3d l = Eigen::Vector3d::Constant(b);
    l[k] = 1.0 - 2.0 * b;
    rule.push_back({l, weight});
  }
}

}  // namespace

DisplacementSpace make_space(TetMesh mesh, Element element) {
  DisplacementSpace space;
  space.element = element;
  space.mesh = std::move(mesh);
  space.nodes = space.mesh.nodes;
  space.elements = space.mesh.tets;
  if (element == Element::kP1) return space;

  space.edges = sorted_edges(space.mesh);
  const int vertices = space.num_vertices();
  space.nodes.conservativeResize(Eigen::NoChange,
                                 vertices + static_cast<Eigen::Index>(space.edges.size()));
  for (std::size_t e = 0; e < space.edges.size(); ++e) {
    const auto& [a, b] = space.edges[e];
    space.nodes.col(vertices + static_cast<Eigen::Index>(e)) =
        0.5 * (space.mesh.nodes.col(a) + space.mesh.nodes.col(b));
  }
  space.elements.conservativeResize(kMaxElementNodes, Eigen::NoChange);
  for (int t = 0; t < space.num_elements(); ++t) {
    for (std::size_t e = 0; e < kTetEdges.size(); ++e) {
      space.elements(4 + static_cast<Eigen::Index>(e), t) = edge_node(
          space, space.mesh.tets(kTetEdges[e][0], t), space.mesh.tets(kTetEdges[e][1], t));
    }
  }
  return space;
}

std::array<int, kMaxFaceNodes> face_nodes(const DisplacementSpace& space,
                                          const Eigen::Vector3i& vertices) {
  std::array<int, kMaxFaceNodes> nodes = {vertices[0], vertices[1], vertices[2], -1, -1, -1};
  if (space.element == Element::kP1) return nodes;
  for (std::size_t e = 0; e < kFaceEdges.size(); ++e) {
    nodes[3 + e] = edge_node(space, vertices[kFaceEdges[e][0]], vertices[kFaceEdges[e][1]]);
  }
  return nodes;
}

ShapeValues shape_values(Element element, const Eigen::Vector4d& l) {
  if (element == Element::kP1) return l;
  ShapeValues n(kMaxElementNodes);
  for (int k = 0; k < 4; ++k) n[k] = l[k] * (2.0 * l[k] - 1.0);
  for (std::size_t e = 0; e < kTetEdges.size(); ++e) {
    n[4 + static_cast<Eigen::Index>(e)] = 4.0 * l[kTetEdges[e][0]] * l[kTetEdges[e][1]];
  }
  return n;
}

ShapeGradients shape_gradients(Element element, const Eigen::Matrix<double, 3, 4>& vertex_gradients,
                               const Eigen::Vector4d& l) {
  if (element == Element::kP1) return vertex_gradients;
  ShapeGradients g(3, kMaxElementNodes);
  for (int k = 0; k < 4; ++k) g.col(k) = (4.0 * l[k] - 1.0) * vertex_gradients.col(k);
  for (std::size_t e = 0; e < kTetEdges.size(); ++e) {
    const auto& [a, b] = kTetEdges[e];
    g.col(4 + static_cast<Eigen::Index>(e)) =
        4.0 * (l[a] * vertex_gradients.col(b) + l[b] * vertex_gradients.col(a));
  }
  return g;
}

Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxFaceNodes, 1> face_shape_values(
    Element element, const Eigen::Vector3d& l) {
  if (element == Element::kP1) return l;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxFaceNodes, 1> n(kMaxFaceNodes);
  for (int k = 0; k < 3; ++k) n[k] = l[k] * (2.0 * l[k] - 1.0);
  for (std::size_t e = 0; e < kFaceEdges.size(); ++e) {
    n[3 + static_cast<Eigen::Index>(e)] = 4.0 * l[kFaceEdges[e][0]] * l[kFaceEdges[e][1]];
  }
  return n;
}

const std::vector<TetPoint>& stiffness_rule(Element element) {
  static const std::vector<TetPoint> linear = {{Eigen::Vector4d::Constant(0.25), 1.0}};
  static const std::vector<TetPoint> quadratic = [] {
    std::vector<TetPoint> rule;
    add_vertex_points(rule, 0.1381966011250105, 0.25);
    return rule;
  }();
  return element == Element::kP1 ? linear : quadratic;
}

const std::vector<TetPoint>& fine_tet_rule() {
  static const std::vector<TetPoint> points = [] {
    std::vector<TetPoint> rule;
    add_vertex_points(rule, 0.31088591926330060980, 0.11268792571801585080);
    add_vertex_points(rule, 0.092735250310891226402, 0.073493043116361949544);
    add_edge_points(rule, 0.045503704125649649492, 0.042546020777081466438);
    return rule;
  }();
  return points;
}

const std::vector<TrianglePoint>& coarse_triangle_rule() {
  static const std::vector<TrianglePoint> points = [] {
    std::vector<TrianglePoint> rule;
    add_triangle_points(rule, 1.0 / 6.0, 1.0 / 3.0);
    return rule;
  }();
  return points;
}

const std::vector<TrianglePoint>& fine_triangle_rule() {
  static const std::vector<TrianglePoint> points = [] {
    std::vector<TrianglePoint> rule;
    add_triangle_points(rule, 0.44594849091596488632, 0.22338158967801146570);
    add_triangle_points(rule, 0.09157621350977074346, 0.10995174365532186764);
    return rule;
  }();
  return points;
}

}  // namespace brainshift::fem
