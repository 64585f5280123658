// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/twin/load.hpp"

#include "common/fem/elasticity.hpp"

namespace brainshift::twin {

Vec3 craniotomy_centre(const BrainModel& model) {
  Vec3 centre = Vec3::Zero();
  for (NodeIndex node : model.craniotomy) centre += model.mesh.nodes.col(node);
  return centre / static_cast<double>(model.craniotomy.size());
}

Vec3 swelling_centre(const BrainModel& model, const Swelling& swelling) {
  const Vec3 tumour = model.tumour.vertices.rowwise().mean();
  if (swelling.depth_mm == 0.0) return tumour;
  return tumour + swelling.depth_mm * (tumour - craniotomy_centre(model)).normalized();
}

double volume_strain_at(const Swelling& swelling, double distance_mm) {
  if (!(distance_mm < swelling.radius_mm)) return 0.0;
  const double ratio = distance_mm / swelling.radius_mm;
  const double fade = 1.0 - ratio * ratio;
  return swelling.volume_strain * fade * fade;
}

Points swelling_load(const TetMesh& mesh, const Material& material, const Vec3& centre,
                     const Swelling& swelling) {
  const fem::Elasticity elasticity = fem::elasticity_from(material);
  const double bulk = elasticity.lambda + 2.0 / 3.0 * elasticity.shear;
  Points load = Points::Zero(3, mesh.num_nodes());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    Vec3 centroid = Vec3::Zero();
    for (int k = 0; k < 4; ++k) centroid += 0.25 * mesh.nodes.col(mesh.tets(k, t));
    const double strain = volume_strain_at(swelling, (centroid - centre).norm());
    if (strain == 0.0) continue;
    const fem::TetGeometry tet = fem::tet_geometry(mesh, t);
    for (int k = 0; k < 4; ++k) {
      load.col(mesh.tets(k, t)) += tet.volume * bulk * strain * tet.gradients.col(k);
    }
  }
  return load;
}

}  // namespace brainshift::twin
