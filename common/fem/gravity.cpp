// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/gravity.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/core/units.hpp"
#include "common/fem/elasticity.hpp"
#include "common/fem/space_elasticity.hpp"

namespace brainshift::fem {

double negative_volume_fraction(const Eigen::Vector4d& values) {
  Eigen::Vector4d v = values;
  std::sort(v.data(), v.data() + 4);
  if (v[0] >= 0.0) return 0.0;
  if (v[3] <= 0.0) return 1.0;
  // One corner negative: the cut-off corner is similar to the tetrahedron along its three edges.
  if (v[1] >= 0.0) {
    return v[0] / (v[0] - v[1]) * (v[0] / (v[0] - v[2])) * (v[0] / (v[0] - v[3]));
  }
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

}  // namespace brainshift::fem
