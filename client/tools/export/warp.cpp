// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/export/warp.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "common/core/thread_team.hpp"
#include "common/geometry/surface.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::client {
namespace {

bool holds(const VoxelImage& image, const Vec3& index) {
  for (int axis = 0; axis < 3; ++axis) {
    const int voxels = image.dims[static_cast<std::size_t>(axis)];
    if (!(index[axis] >= -0.5 && index[axis] < voxels - 0.5)) return false;
  }
  return true;
}

double finite_or_zero(float value) { return std::isfinite(value) ? value : 0.0; }

// Precondition: holds(image, index).
double interpolated(const VoxelImage& image, const Vec3& index) {
  int low[3], high[3];
  double part[3];
  for (int axis = 0; axis < 3; ++axis) {
    const int last = image.dims[static_cast<std::size_t>(axis)] - 1;
    const double place = std::clamp(index[axis], 0.0, static_cast<double>(last));
    low[axis] = static_cast<int>(place);
    high[axis] = std::min(low[axis] + 1, last);
    part[axis] = place - low[axis];
  }
  double value = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    int at[3];
    for (int axis = 0; axis < 3; ++axis) {
      const bool upper = ((corner >> axis) & 1) != 0;
      weight *= upper ? part[axis] : 1.0 - part[axis];
      at[axis] = upper ? high[axis] : low[axis];
    }
    value += weight * finite_or_zero(image.at(at[0], at[1], at[2]));
  }
  return value;
}

DeformedSurface moved(TriangleSurface surface, const Points& u, const Uncertainty& of) {
  DeformedSurface out;
  out.surface = std::move(surface);
  out.surface.vertices += u;
  out.vertex_fields.push_back({"displacement_mm", u});
  if (of.sd_mm.size() > 0) out.vertex_fields.push_back({"sd_mm", of.sd_mm.transpose()});
  if (of.known.size() > 0) out.vertex_fields.push_back({"known", of.known.transpose()});
  return out;
}

}  // namespace

Result<io::ScalarVolume> warp_image(const VoxelImage& image, const io::DisplacementField& field) {
  if (Status ok = validate(field); !ok) return tl::unexpected(ok.error());
  if (field.direction != io::FieldDirection::kResampling) {
    return invalid("an image is warped by a field of direction resampling, not modeling");
  }
  const io::VoxelGrid& grid = field.grid;
  io::ScalarVolume warped{grid, std::vector<float>(grid.num_voxels(), 0.0F), field.note};
  const AffineTransform T_voxel_ras(image.T_ras_voxel.inverse(Eigen::Affine));
  std::atomic<bool> any{false};
  ThreadTeam team;
  team.split(grid.dims[2], [&](long begin, long end) {
    bool found = false;
    for (int k = static_cast<int>(begin); k < end; ++k) {
      for (int j = 0; j < grid.dims[1]; ++j) {
        for (int i = 0; i < grid.dims[0]; ++i) {
          const std::size_t voxel = grid.index(i, j, k);
          const float* v = field.ras_mm.data() + 3 * voxel;
          const Vec3 index = T_voxel_ras * (grid.voxel_mm(i, j, k) + Vec3(v[0], v[1], v[2]));
          if (!holds(image, index)) continue;
          found = true;
          warped.values[voxel] = static_cast<float>(interpolated(image, index));
        }
      }
    }
    if (found) any = true;
  });
  if (!any) {
    return invalid("no voxel of the grid lies in the image: are both in the patient's RAS frame?");
  }
  return warped;
}

DeformedSurface deformed_tumour(const BrainModel& model, const Points& u, const Uncertainty& of) {
  const geometry::TetLocator locator(model.mesh);
  const int vertices = model.tumour.num_vertices();
  Points at_vertices(3, vertices);
  Uncertainty there{VecX(of.sd_mm.size() > 0 ? vertices : 0),
                    VecX(of.known.size() > 0 ? vertices : 0)};
  for (int v = 0; v < vertices; ++v) {
    const auto at = locator.locate(model.tumour.vertices.col(v));
    at_vertices.col(v) = geometry::value_at(at, u);
    if (there.sd_mm.size() > 0) there.sd_mm[v] = geometry::value_at(at, of.sd_mm);
    if (there.known.size() > 0) there.known[v] = geometry::value_at(at, of.known);
  }
  return moved(model.tumour, at_vertices, there);
}

DeformedSurface deformed_triangles(const BrainModel& model,
                                   const Eigen::Matrix<int, 3, Eigen::Dynamic>& triangles,
                                   const Points& u, const Uncertainty& of) {
  std::vector<NodeIndex> node_of_vertex;
  TriangleSurface surface = geometry::surface_of(model.mesh.nodes, triangles, &node_of_vertex);
  const auto there = [&](const VecX& values) {
    return values.size() > 0 ? VecX(values(node_of_vertex)) : VecX();
  };
  return moved(std::move(surface), u(Eigen::all, node_of_vertex),
               {there(of.sd_mm), there(of.known)});
}

}  // namespace brainshift::client
