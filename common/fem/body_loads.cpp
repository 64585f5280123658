// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/body_loads.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>

#include "common/core/units.hpp"
#include "common/fem/space_elasticity.hpp"

namespace brainshift::fem {

double negative_volume_fraction(const Eigen::Vector4d& values) {
  Eigen::Vector4d v = values;
  std::sort(v.data(), v.data() + 4);
  if (v[0] >= 0.0) return 0.0;
  if (v[3] <= 0.0) return 1.0;
  // One corner negative: the cut-off corner is similar to the tetrahedron along its three edges.
  if (v[1] >= 0.0) return v[0] / (v[0] - v[1]) * (v[0] / (v[0] - v[2])) * (v[0] / (v[0] - v[3]));
  // One corner positive: the complement, from the other side.
  if (v[2] <= 0.0) {
    return 1.0 - v[3] / (v[3] - v[0]) * (v[3] / (v[3] - v[1])) * (v[3] / (v[3] - v[2]));
  }
  // Two and two: corners A, B negative, C, D positive. The wedge cut off at fractions s, t (edges
  // AC, AD) and p, q (BC, BD) splits into three tetrahedra; every term is positive, so nothing
  // cancels.
  const double a = -v[0], b = -v[1], c = v[2], d = v[3];
  const double s = a / (a + c), t = a / (a + d), p = b / (b + c), q = b / (b + d);
  return s * t + s * (1.0 - t) * q + (1.0 - s) * p * q;
}

Points buoyancy_load(const TetMesh& mesh, const Material& material, const Vec3& gravity_direction,
                     double plane_depth_mm, const Vec3& force_direction) {
  const double above = units::weight_density_from_kg_m3(material.tissue_density_kg_m3 -
                                                        material.fluid_density_unsaturated_kg_m3);
  const double below = units::weight_density_from_kg_m3(material.tissue_density_kg_m3 -
                                                        material.fluid_density_saturated_kg_m3);
  const VecX depth = mesh.nodes.transpose() * gravity_direction;
  Points load = Points::Zero(3, mesh.num_nodes());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    Eigen::Vector4d relative;
    for (int k = 0; k < 4; ++k) relative[k] = depth[mesh.tets(k, t)] - plane_depth_mm;
    const double fraction = negative_volume_fraction(relative);
    const double density = fraction * above + (1.0 - fraction) * below;
    if (density == 0.0) continue;
    const Vec3 quarter = 0.25 * tet_geometry(mesh, t).volume * density * force_direction;
    for (int k = 0; k < 4; ++k) load.col(mesh.tets(k, t)) += quarter;
  }
  return load;
}

Points buoyancy_load(const DisplacementSpace& space, const Material& material,
                     const Vec3& gravity_direction, double plane_depth_mm) {
  const double above = units::weight_density_from_kg_m3(material.tissue_density_kg_m3 -
                                                        material.fluid_density_unsaturated_kg_m3);
  const double below = units::weight_density_from_kg_m3(material.tissue_density_kg_m3 -
                                                        material.fluid_density_saturated_kg_m3);
  return body_load(space, [&](const Vec3& x) -> Vec3 {
    return (x.dot(gravity_direction) < plane_depth_mm ? above : below) * gravity_direction;
  });
}

namespace {

Vec3 centroid_of(const TetMesh& mesh, int tet) {
  Vec3 centroid = Vec3::Zero();
  for (int k = 0; k < 4; ++k) centroid += 0.25 * mesh.nodes.col(mesh.tets(k, tet));
  return centroid;
}

// stress_of(t, centroid of t): sigma0 of tetrahedron t.
template <typename Stress>
Points load_of(const TetMesh& mesh, const Stress& stress_of) {
  Points load = Points::Zero(3, mesh.num_nodes());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const Mat3 stress = stress_of(t, centroid_of(mesh, t));
    if (stress.isZero(0.0)) continue;
    const TetGeometry tet = tet_geometry(mesh, t);
    for (int k = 0; k < 4; ++k) {
      load.col(mesh.tets(k, t)) -= tet.volume * stress * tet.gradients.col(k);
    }
  }
  return load;
}

}  // namespace

Points swelling_load(const TetMesh& mesh, const std::vector<Elasticity>& of_tet,
                     const std::function<double(const Vec3&)>& strain) {
  assert(static_cast<int>(of_tet.size()) == mesh.num_tets());
  return load_of(mesh, [&](int t, const Vec3& centroid) -> Mat3 {
    const Elasticity& elasticity = of_tet[static_cast<std::size_t>(t)];
    const double bulk = elasticity.lambda + 2.0 / 3.0 * elasticity.shear;
    return -bulk * strain(centroid) * Mat3::Identity();
  });
}

Points swelling_load(const TetMesh& mesh, const Material& material,
                     const std::function<double(const Vec3&)>& strain) {
  return swelling_load(
      mesh,
      std::vector<Elasticity>(static_cast<std::size_t>(mesh.num_tets()), elasticity_from(material)),
      strain);
}

Points swelling_load(const DisplacementSpace& space, const Material& material,
                     const std::function<double(const Vec3&)>& strain) {
  const Elasticity elasticity = elasticity_from(material);
  const double bulk = elasticity.lambda + 2.0 / 3.0 * elasticity.shear;
  Points load = Points::Zero(3, space.num_nodes());
  for (int e = 0; e < space.num_elements(); ++e) {
    const TetGeometry tet = tet_geometry(space.mesh, e);
    for (const TetPoint& point : fine_tet_rule()) {
      Vec3 x = Vec3::Zero();
      for (int k = 0; k < 4; ++k) x += point.l[k] * space.mesh.nodes.col(space.mesh.tets(k, e));
      const double pressure = point.weight * tet.volume * bulk * strain(x);
      if (pressure == 0.0) continue;
      const ShapeGradients g = shape_gradients(space.element, tet.gradients, point.l);
      for (int k = 0; k < g.cols(); ++k) load.col(space.elements(k, e)) += pressure * g.col(k);
    }
  }
  return load;
}

Points initial_stress_load(const TetMesh& mesh, const std::function<Mat3(const Vec3&)>& stress) {
  return load_of(mesh, [&](int, const Vec3& centroid) { return stress(centroid); });
}

Points wall_pressure_load(const Points& nodes, const Eigen::Matrix<int, 3, Eigen::Dynamic>& wall,
                          const std::function<double(const Vec3&)>& pressure) {
  Points load = Points::Zero(3, nodes.cols());
  for (const auto& triangle : wall.colwise()) {
    const Vec3 a = nodes.col(triangle[0]), b = nodes.col(triangle[1]), c = nodes.col(triangle[2]);
    const Vec3 force = -0.5 * pressure((a + b + c) / 3.0) * (b - a).cross(c - a);
    for (const int node : triangle) load.col(node) += force / 3.0;
  }
  return load;
}

}  // namespace brainshift::fem
