// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/twin/load.hpp"

#include "common/fem/swelling.hpp"

namespace brainshift::client {

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
  return fem::swelling_load(mesh, material, [&](const Vec3& x) {
    return volume_strain_at(swelling, (x - centre).norm());
  });
}

}  // namespace brainshift::client
