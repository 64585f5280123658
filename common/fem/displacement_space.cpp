// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/displacement_space.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
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

// For each (b, weight) all points that permute (a, b, b).
std::vector<TrianglePoint> triangle_rule(const std::vector<std::pair<double, double>>& orbits) {
  std::vector<TrianglePoint> rule;
  for (const auto& [b, weight] : orbits) {
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d l = Eigen::Vector3d::Constant(b);
      l[k] = 1.0 - 2.0 * b;
      rule.push_back({l, weight});
    }
  }
  return rule;
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
  static const auto points = triangle_rule({{1.0 / 6.0, 1.0 / 3.0}});
  return points;
}

const std::vector<TrianglePoint>& fine_triangle_rule() {
  static const auto points = triangle_rule({{0.44594849091596488632, 0.22338158967801146570},
                                            {0.09157621350977074346, 0.10995174365532186764}});
  return points;
}

namespace {

// Two directions whose sine is below this count as one, and a normal this close to a coordinate
// axis counts as that axis.
constexpr double kParallel = 1e-6;
constexpr double kAxisAligned = 1e-12;
// Values that differ by less than this do not contradict each other; relative to 1 mm or the
// value.
constexpr double kSameValue = 1e-9;

Vec3 snapped(const Vec3& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  const Vec3 unit = direction[axis] > 0.0 ? Vec3(Vec3::Unit(axis)) : Vec3(-Vec3::Unit(axis));
  return (direction - unit).norm() < kAxisAligned ? unit : direction;
}

bool is_coordinate_axis(const Vec3& v) { return v.cwiseAbs().maxCoeff() == 1.0; }

}  // namespace

DisplacementConstraints::DisplacementConstraints(int num_nodes)
    : of_node_(static_cast<std::size_t>(num_nodes)) {}

Status DisplacementConstraints::add(NodeIndex node, const Vec3& direction, double value,
                                    const std::string& source) {
  assert(std::abs(direction.norm() - 1.0) < 1e-9);
  if (sources_.empty() || sources_.back() != source) sources_.push_back(source);
  const int source_index = static_cast<int>(sources_.size()) - 1;
  auto& known = of_node_[static_cast<std::size_t>(node)];
  Vec3 rest = snapped(direction);
  double rest_value = value;
  double spanned_value = 0.0;
  for (const Direction& other : known) {
    const double along = direction.dot(other.axis);
    rest -= along * other.axis;
    rest_value -= along * other.value;
    spanned_value += along * other.value;
  }
  const double length = rest.norm();
  if (length < kParallel) {
    if (std::abs(spanned_value - value) <= kSameValue * (1.0 + std::abs(value))) return {};
    return invalid(
        fmt::format("{} prescribes {} mm at node {}, but {} prescribes {} mm there", source, value,
                    node, sources_[static_cast<std::size_t>(known.back().source)], spanned_value));
  }
  known.push_back({snapped(rest / length), rest_value / length, source_index});
  return {};
}

Status DisplacementConstraints::add_all(NodeIndex node, const Vec3& value,
                                        const std::string& source) {
  for (int axis = 0; axis < 3; ++axis) {
    if (Status ok = add(node, Vec3::Unit(axis), value[axis], source); !ok) return ok;
  }
  return {};
}

std::vector<Vec3> DisplacementConstraints::directions(NodeIndex node) const {
  std::vector<Vec3> axes;
  for (const Direction& d : of_node_[static_cast<std::size_t>(node)]) axes.push_back(d.axis);
  return axes;
}

ConstrainedDofs DisplacementConstraints::build() const {
  const auto n = static_cast<int>(of_node_.size());
  ConstrainedDofs result{DofMap(n), Points::Zero(3, n)};
  for (int node = 0; node < n; ++node) {
    const auto axes = directions(node);
    if (axes.empty()) continue;
    for (const Direction& d : of_node_[static_cast<std::size_t>(node)]) {
      result.lift.col(node) += d.value * d.axis;
    }
    bool coordinate = true;
    for (const Vec3& axis : axes) coordinate = coordinate && is_coordinate_axis(axis);
    if (axes.size() == 3) {
      result.dofs.fix_all(node);
    } else if (coordinate) {
      for (const Vec3& axis : axes) {
        int component = 0;
        axis.cwiseAbs().maxCoeff(&component);
        result.dofs.fix_component(node, component);
      }
    } else if (axes.size() == 1) {
      result.dofs.fix_normal(node, axes[0]);
    } else {
      result.dofs.fix_plane(node, axes[0], axes[1]);
    }
  }
  result.dofs.finalise();
  return result;
}

}  // namespace brainshift::fem
