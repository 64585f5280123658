// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/load.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/core/units.hpp"
#include "common/fem/body_loads.hpp"
#include "common/geometry/surface.hpp"

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

Points retraction_load(const BrainModel& model, const Retraction& retraction) {
  std::vector<NodeIndex> exposed = model.craniotomy;
  std::sort(exposed.begin(), exposed.end());
  const TriangleSurface opening =
      geometry::surface_between(model.mesh.nodes, model.boundary_triangles, exposed);
  const VecX areas_mm2 = geometry::vertex_areas(opening);
  const Vec3 normal = geometry::vector_area(opening).normalized();
  const auto in_plane = [&normal](const Vec3& v) -> Vec3 { return v - normal.dot(v) * normal; };
  const double angle = retraction.angle_deg * std::numbers::pi / 180.0;
  const Vec3 direction =
      -std::cos(angle) * normal + std::sin(angle) * in_plane(retraction.aside).normalized();
  const Vec3 middle = craniotomy_centre(model) + in_plane(retraction.offset_mm);
  const double pressure = units::stress_from_pa(retraction.pressure_pa);
  Points load = Points::Zero(3, model.mesh.num_nodes());
  for (std::size_t i = 0; i < exposed.size(); ++i) {
    const auto vertex = static_cast<Eigen::Index>(i);
    const double ratio = (opening.vertices.col(vertex) - middle).norm() / retraction.radius_mm;
    if (!(ratio < 1.0)) continue;
    const double fade = 1.0 - ratio * ratio;
    load.col(exposed[i]) = areas_mm2[vertex] * pressure * fade * fade * direction;
  }
  return load;
}

}  // namespace brainshift::client
