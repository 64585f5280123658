// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/twin/retraction.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <set>

#include "client/twin/load.hpp"
#include "common/core/units.hpp"

namespace brainshift::client {

Points retraction_load(const BrainModel& model, const Retraction& retraction) {
  const Points& nodes = model.mesh.nodes;
  const std::set<NodeIndex> exposed(model.craniotomy.begin(), model.craniotomy.end());
  VecX area_mm2 = VecX::Zero(nodes.cols());
  Vec3 normal = Vec3::Zero();
  for (Eigen::Index t = 0; t < model.boundary_triangles.cols(); ++t) {
    const Eigen::Vector3i corner = model.boundary_triangles.col(t);
    if (!exposed.count(corner[0]) || !exposed.count(corner[1]) || !exposed.count(corner[2])) {
      continue;
    }
    const Vec3 a = nodes.col(corner[0]);
    const Vec3 vector_area =
        0.5 * Vec3(nodes.col(corner[1]) - a).cross(Vec3(nodes.col(corner[2]) - a));
    normal += vector_area;
    for (const int node : corner) area_mm2[node] += vector_area.norm() / 3.0;
  }
  normal.normalize();
  const auto in_plane = [&normal](const Vec3& v) -> Vec3 { return v - normal.dot(v) * normal; };
  const double angle = retraction.angle_deg * std::numbers::pi / 180.0;
  const Vec3 direction =
      -std::cos(angle) * normal + std::sin(angle) * in_plane(retraction.aside).normalized();
  const Vec3 middle = craniotomy_centre(model) + in_plane(retraction.offset_mm);
  const double pressure = units::stress_from_pa(retraction.pressure_pa);
  Points load = Points::Zero(3, nodes.cols());
  for (const NodeIndex node : exposed) {
    const double ratio = (nodes.col(node) - middle).norm() / retraction.radius_mm;
    if (!(ratio < 1.0)) continue;
    const double fade = 1.0 - ratio * ratio;
    load.col(node) = area_mm2[node] * pressure * fade * fade * direction;
  }
  return load;
}

}  // namespace brainshift::client
