// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/swelling.hpp"

#include "common/fem/elasticity.hpp"

namespace brainshift::fem {

Points swelling_load(const TetMesh& mesh, const Material& material,
                     const std::function<double(const Vec3&)>& strain) {
  const Elasticity elasticity = elasticity_from(material);
  const double bulk = elasticity.lambda + 2.0 / 3.0 * elasticity.shear;
  Points load = Points::Zero(3, mesh.num_nodes());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    Vec3 centroid = Vec3::Zero();
    for (int k = 0; k < 4; ++k) centroid += 0.25 * mesh.nodes.col(mesh.tets(k, t));
    const double theta = strain(centroid);
    if (theta == 0.0) continue;
    const TetGeometry tet = tet_geometry(mesh, t);
    for (int k = 0; k < 4; ++k) {
      load.col(mesh.tets(k, t)) += tet.volume * bulk * theta * tet.gradients.col(k);
    }
  }
  return load;
}

}  // namespace brainshift::fem
