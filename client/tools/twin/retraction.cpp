// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/retraction.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "client/tools/twin/load.hpp"
#include "common/core/units.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::client {

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
