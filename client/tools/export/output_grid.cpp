// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/export/output_grid.hpp"

#include "client/tools/volume/field_grid.hpp"

namespace brainshift::client {
namespace {

Result<io::VoxelGrid> checked(const io::VoxelGrid& grid) {
  if (Status ok = validate(grid); !ok) return tl::unexpected(ok.error());
  return grid;
}

}  // namespace

Result<io::VoxelGrid> grid_like(const VoxelImage& image) {
  return checked({image.dims, image.T_ras_voxel});
}

Result<io::VoxelGrid> grid_around_brain(const TetMesh& mesh, const Points& u, double spacing_mm,
                                        const OutsideTaper& taper) {
  Points both(3, 2 * mesh.nodes.cols());
  both << mesh.nodes, mesh.nodes + u;
  const auto around = grid_around(both, taper.zero_mm, spacing_mm);
  if (!around) return tl::unexpected(around.error());
  io::VoxelGrid grid;
  grid.dims = around->dims;
  grid.T_ras_voxel.linear() = spacing_mm * Mat3::Identity();
  grid.T_ras_voxel.translation() = around->origin_mm;
  return checked(grid);
}

}  // namespace brainshift::client
