// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/space_elasticity.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

namespace brainshift::fem {
namespace {

Vec3 place(const TetMesh& mesh, int tet, const Eigen::Vector4d& l) {
  Vec3 x = Vec3::Zero();
  for (int k = 0; k < 4; ++k) x += l[k] * mesh.nodes.col(mesh.tets(k, tet));
  return x;
}

// Blocks of one element's stiffness; gradients at the points of its rule.
class ElementStiffness {
 public:
  ElementStiffness(const DisplacementSpace& space, const Elasticity& material, int element)
      : material_(material) {
    const TetGeometry geometry = tet_geometry(space.mesh, element);
    const auto& rule = stiffness_rule(space.element);
    points_ = rule.size();
    for (std::size_t q = 0; q < points_; ++q) {
      gradients_[q] = shape_gradients(space.element, geometry.gradients, rule[q].l);
      weights_[q] = rule[q].weight * geometry.volume;
    }
  }
  Mat3 operator()(int i, int j) const {
    Mat3 sum = Mat3::Zero();  // int g_i g_j^T
    for (std::size_t q = 0; q < points_; ++q) {
      sum += weights_[q] * gradients_[q].col(i) * gradients_[q].col(j).transpose();
    }
    return material_.lambda * sum + material_.shear * sum.transpose() +
           material_.shear * sum.trace() * Mat3::Identity();
  }

 private:
  Elasticity material_;
  std::size_t points_ = 0;
  std::array<ShapeGradients, 4> gradients_;
  std::array<double, 4> weights_{};
};

Vec3 face_area_vector(const TetMesh& mesh, const Eigen::Vector3i& face) {
  const Vec3 a = mesh.nodes.col(face[0]);
  return 0.5 * (mesh.nodes.col(face[1]) - a).cross(mesh.nodes.col(face[2]) - a);
}

// The barycentric points of an element's nodes, in its order, then its centroid.
std::vector<Eigen::Vector4d> node_points(Element element) {
  std::vector<Eigen::Vector4d> points;
  for (int k = 0; k < 4; ++k) points.emplace_back(Eigen::Vector4d::Unit(k));
  if (element == Element::kP2) {
    constexpr std::array<std::array<int, 2>, 6> kEdges = {
        {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};
    for (const auto& [a, b] : kEdges) points.emplace_back(0.5 * (points[a] + points[b]));
  }
  points.emplace_back(Eigen::Vector4d::Constant(0.25));
  return points;
}

Mat3 gradient_of(const DisplacementSpace& space, const Points& u, int element,
                 const ShapeGradients& g) {
  Mat3 gradient = Mat3::Zero();
  for (int k = 0; k < g.cols(); ++k) {
    gradient += u.col(space.elements(k, element)) * g.col(k).transpose();
  }
  return gradient;
}

}  // namespace

linalg::SymmetricMatrix assemble_stiffness(const DisplacementSpace& space,
                                           const MaterialMap& materials, const DofMap& dofs) {
  assert(static_cast<int>(materials.of_tet.size()) == space.num_elements());
  return assemble_lower(space.elements, dofs, [&](int element) {
    return ElementStiffness(space, materials.at(element).elastic, element);
  });
}

Points internal_force(const DisplacementSpace& space, const MaterialMap& materials,
                      const Points& u) {
  Points force = Points::Zero(3, space.num_nodes());
  for (int e = 0; e < space.num_elements(); ++e) {
    const TetGeometry geometry = tet_geometry(space.mesh, e);
    const Elasticity& material = materials.at(e).elastic;
    for (const TetPoint& point : stiffness_rule(space.element)) {
      const ShapeGradients g = shape_gradients(space.element, geometry.gradients, point.l);
      const Mat3 gradient = gradient_of(space, u, e, g);
      const Mat3 stress = material.lambda * gradient.trace() * Mat3::Identity() +
                          material.shear * (gradient + gradient.transpose());
      const Mat3 weighted = point.weight * geometry.volume * stress;
      for (int k = 0; k < g.cols(); ++k) force.col(space.elements(k, e)) += weighted * g.col(k);
    }
  }
  return force;
}

Points body_load(const DisplacementSpace& space, const Points& density) {
  assert(density.cols() == space.num_elements());
  Points load = Points::Zero(3, space.num_nodes());
  const bool linear = space.element == Element::kP1;
  for (int e = 0; e < space.num_elements(); ++e) {
    const Vec3 force = tet_geometry(space.mesh, e).volume * density.col(e);
    for (int k = 0; k < space.nodes_per_element(); ++k) {
      // Integrals of the shape functions over a tetrahedron of volume one.
      const double share = linear ? 0.25 : k < 4 ? -0.05 : 0.2;
      load.col(space.elements(k, e)) += share * force;
    }
  }
  return load;
}

Points body_load(const DisplacementSpace& space, const VectorField& density) {
  Points load = Points::Zero(3, space.num_nodes());
  for (int e = 0; e < space.num_elements(); ++e) {
    const double volume = tet_geometry(space.mesh, e).volume;
    for (const TetPoint& point : fine_tet_rule()) {
      const ShapeValues n = shape_values(space.element, point.l);
      const Vec3 force = point.weight * volume * density(place(space.mesh, e, point.l));
      for (int k = 0; k < n.size(); ++k) load.col(space.elements(k, e)) += n[k] * force;
    }
  }
  return load;
}

Points traction_load(const DisplacementSpace& space,
                     const Eigen::Matrix<int, 3, Eigen::Dynamic>& faces,
                     const VectorField& traction) {
  Points load = Points::Zero(3, space.num_nodes());
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    const Eigen::Vector3i face = faces.col(f);
    const auto nodes = face_nodes(space, face);
    const double area = face_area_vector(space.mesh, face).norm();
    for (const TrianglePoint& point : fine_triangle_rule()) {
      Vec3 x = Vec3::Zero();
      for (int k = 0; k < 3; ++k) x += point.l[k] * space.mesh.nodes.col(face[k]);
      const auto n = face_shape_values(space.element, point.l);
      const Vec3 force = point.weight * area * traction(x);
      for (int k = 0; k < n.size(); ++k)
        load.col(nodes[static_cast<std::size_t>(k)]) += n[k] * force;
    }
  }
  return load;
}

Points pressure_load(const DisplacementSpace& space,
                     const Eigen::Matrix<int, 3, Eigen::Dynamic>& faces, double pressure) {
  Points load = Points::Zero(3, space.num_nodes());
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    const Eigen::Vector3i face = faces.col(f);
    const auto nodes = face_nodes(space, face);
    const Vec3 third = -pressure / 3.0 * face_area_vector(space.mesh, face);
    // A third per vertex (P1); the vertices' shape functions of P2 integrate to zero, the edges'
    // to a third.
    const std::size_t first = space.element == Element::kP1 ? 0 : 3;
    for (std::size_t k = first; k < first + 3; ++k) load.col(nodes[k]) += third;
  }
  return load;
}

Mat3 displacement_gradient(const DisplacementSpace& space, const Points& u, int element,
                           const Eigen::Vector4d& l) {
  const TetGeometry geometry = tet_geometry(space.mesh, element);
  return gradient_of(space, u, element, shape_gradients(space.element, geometry.gradients, l));
}

Vec3 displacement_at(const DisplacementSpace& space, const Points& u, int element,
                     const Eigen::Vector4d& l) {
  const ShapeValues n = shape_values(space.element, l);
  Vec3 value = Vec3::Zero();
  for (int k = 0; k < n.size(); ++k) value += n[k] * u.col(space.elements(k, element));
  return value;
}

Stress stress_from(const Elasticity& material, const Mat3& gradient) {
  const Mat3 s = material.lambda * gradient.trace() * Mat3::Identity() +
                 material.shear * (gradient + gradient.transpose());
  Stress stress;
  stress << s(0, 0), s(1, 1), s(2, 2), s(0, 1), s(1, 2), s(0, 2);
  return stress;
}

double von_mises(const Stress& s) {
  const double normal =
      (s[0] - s[1]) * (s[0] - s[1]) + (s[1] - s[2]) * (s[1] - s[2]) + (s[2] - s[0]) * (s[2] - s[0]);
  return std::sqrt(0.5 * normal + 3.0 * s.tail<3>().squaredNorm());
}

Eigen::MatrixXd element_stress(const DisplacementSpace& space, const MaterialMap& materials,
                               const Points& u) {
  Eigen::MatrixXd stress(6, space.num_elements());
  for (int e = 0; e < space.num_elements(); ++e) {
    stress.col(e) =
        stress_from(materials.at(e).elastic,
                    displacement_gradient(space, u, e, Eigen::Vector4d::Constant(0.25)));
  }
  return stress;
}

Eigen::MatrixXd nodal_stress(const DisplacementSpace& space, const MaterialMap& materials,
                             const Points& u) {
  const auto points = node_points(space.element);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(6, space.num_nodes());
  VecX volumes = VecX::Zero(space.num_nodes());
  for (int e = 0; e < space.num_elements(); ++e) {
    const TetGeometry geometry = tet_geometry(space.mesh, e);
    for (int k = 0; k < space.nodes_per_element(); ++k) {
      const int node = space.elements(k, e);
      const ShapeGradients g =
          shape_gradients(space.element, geometry.gradients, points[static_cast<std::size_t>(k)]);
      sum.col(node) +=
          geometry.volume * stress_from(materials.at(e).elastic, gradient_of(space, u, e, g));
      volumes[node] += geometry.volume;
    }
  }
  return sum * volumes.cwiseInverse().asDiagonal();
}

double min_jacobian(const DisplacementSpace& space, const Points& u) {
  const auto points = node_points(space.element);
  double smallest = std::numeric_limits<double>::infinity();
  for (int e = 0; e < space.num_elements(); ++e) {
    const TetGeometry geometry = tet_geometry(space.mesh, e);
    for (const Eigen::Vector4d& l : points) {
      const ShapeGradients g = shape_gradients(space.element, geometry.gradients, l);
      const Mat3 f = Mat3::Identity() + gradient_of(space, u, e, g);
      smallest = std::min(smallest, f.determinant());
      if (space.element == Element::kP1) break;  // constant
    }
  }
  return smallest;
}

}  // namespace brainshift::fem
