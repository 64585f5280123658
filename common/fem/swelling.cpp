// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/swelling.hpp"

#include <cassert>

namespace brainshift::fem {
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

}  // namespace brainshift::fem
