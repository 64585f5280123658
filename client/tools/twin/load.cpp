// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/load.hpp"

#include <cmath>

#include "common/fem/body_loads.hpp"

namespace brainshift::client {

Vec3 craniotomy_centre(const BrainModel& model) {
  Vec3 centre = Vec3::Zero();
  for (NodeIndex node : model.craniotomy) centre += model.mesh.nodes.col(node);
  return centre / static_cast<double>(model.craniotomy.size());
}

Vec3 swelling_centre(const BrainModel& model, const Swelling& swelling) {
  const Vec3 tumour = model.tumour.vertices.rowwise().mean();
  if (swelling.depth_mm == 0.0) return tumour + swelling.offset_mm;
  return tumour + swelling.depth_mm * (tumour - craniotomy_centre(model)).normalized() +
         swelling.offset_mm;
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

std::function<double(const Vec3&)> volume_change_field(const TetMesh& mesh, const Vec3& tumour,
                                                       const VolumeChange& change) {
  const double middle = 0.5 * (mesh.nodes.row(0).minCoeff() + mesh.nodes.row(0).maxCoeff());
  const double side = tumour[0] < middle ? -1.0 : 1.0;
  return [middle, side, change](const Vec3& x) {
    if (!change.one_hemisphere) return change.strain;
    return 0.5 * change.strain * (1.0 + std::tanh(side * (x[0] - middle) / kFalx_mm));
  };
}

Points volume_change_load(const TetMesh& mesh, const Material& material, const Vec3& tumour,
                          const VolumeChange& change) {
  return fem::swelling_load(mesh, material, volume_change_field(mesh, tumour, change));
}

}  // namespace brainshift::client
