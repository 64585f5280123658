// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/export/deformed_surface.hpp"

#include <utility>

#include "common/geometry/surface.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::client {
namespace {

DeformedSurface moved(TriangleSurface surface, const Points& u, const VecX& sd_mm) {
  DeformedSurface out;
  out.surface = std::move(surface);
  out.surface.vertices += u;
  out.vertex_fields.push_back({"displacement_mm", u});
  if (sd_mm.size() > 0) out.vertex_fields.push_back({"sd_mm", sd_mm.transpose()});
  return out;
}

}  // namespace

DeformedSurface deformed_tumour(const BrainModel& model, const Points& u, const VecX& sd_mm) {
  const geometry::TetLocator locator(model.mesh);
  Points at_vertices(3, model.tumour.num_vertices());
  VecX sd(sd_mm.size() > 0 ? model.tumour.num_vertices() : 0);
  for (int v = 0; v < model.tumour.num_vertices(); ++v) {
    const auto at = locator.locate(model.tumour.vertices.col(v));
    at_vertices.col(v) = geometry::value_at(at, u);
    if (sd.size() > 0) sd[v] = geometry::value_at(at, sd_mm);
  }
  return moved(model.tumour, at_vertices, sd);
}

DeformedSurface deformed_cortex(const BrainModel& model, const Points& u, const VecX& sd_mm) {
  std::vector<NodeIndex> node_of_vertex;
  TriangleSurface surface = geometry::boundary_surface(model.mesh, &node_of_vertex);
  Points at_vertices(3, surface.num_vertices());
  VecX sd(sd_mm.size() > 0 ? surface.num_vertices() : 0);
  for (int v = 0; v < surface.num_vertices(); ++v) {
    const NodeIndex node = node_of_vertex[static_cast<std::size_t>(v)];
    at_vertices.col(v) = u.col(node);
    if (sd.size() > 0) sd[v] = sd_mm[node];
  }
  return moved(std::move(surface), at_vertices, sd);
}

}  // namespace brainshift::client
