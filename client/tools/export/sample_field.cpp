// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/export/sample_field.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <vector>

#include "common/core/thread_team.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::client {
namespace {

Result<io::VoxelGrid> checked(const io::VoxelGrid& grid) {
  return validate(grid).map([&] { return grid; });
}

using io::FieldDirection;

// Voxels along the edge of a block. Where its centre is far from the brain, all of it is zero.
constexpr int kBlock = 8;

double six_volumes(const Points& nodes, const Eigen::Vector4i& tet) {
  Mat3 edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = nodes.col(tet[k + 1]) - nodes.col(tet[0]);
  return edges.determinant();
}

TetMesh deformed(const TetMesh& mesh, const Points& u) {
  return {mesh.nodes + u, mesh.tets, mesh.labels};
}

class Sampling {
 public:
  Sampling(const TetMesh& mesh, const Points& u, const Uncertainty& of, const OutsideTaper& taper,
           FieldSamples& out)
      : locator_(out.field.direction == FieldDirection::kResampling ? deformed(mesh, u) : mesh),
        ratios_(volume_ratios(mesh, u)),
        u_(u),
        of_(of),
        taper_(taper),
        out_(out),
        grid_(out.field.grid),
        sign_(out.field.direction == FieldDirection::kResampling ? -1.0 : 1.0) {}

  // The voxels [i0, i0 + kBlock) x ..., as far as they exist; gives how many lie in the brain.
  std::size_t block(int i0, int j0, int k0) const {
    const int i1 = std::min(i0 + kBlock, grid_.dims[0]), j1 = std::min(j0 + kBlock, grid_.dims[1]),
              k1 = std::min(k0 + kBlock, grid_.dims[2]);
    const Vec3 first = grid_.voxel_mm(i0, j0, k0), last = grid_.voxel_mm(i1 - 1, j1 - 1, k1 - 1);
    const double radius_mm = half_diagonal_mm(Vec3(i1 - i0 - 1, j1 - j0 - 1, k1 - k0 - 1));
    const Vec3 centre = 0.5 * (first + last);
    if (locator_.locate(centre).distance_mm > taper_.zero_mm + radius_mm) return 0;
    std::size_t inside = 0;
    for (int k = k0; k < k1; ++k)
      for (int j = j0; j < j1; ++j)
        for (int i = i0; i < i1; ++i) inside += voxel(i, j, k) ? 1 : 0;
    return inside;
  }

 private:
  // From the centre of a box of so many steps along the axes, which are at right angles, to its
  // corners; a thousandth more, as right angles are checked to 1e-4.
  double half_diagonal_mm(const Vec3& steps) const {
    return 0.5005 * steps.cwiseProduct(grid_.spacing_mm()).norm();
  }

  bool voxel(int i, int j, int k) const {
    const auto at = locator_.locate(grid_.voxel_mm(i, j, k));
    const bool inside = at.distance_mm == 0.0;
    const double factor = taper_.factor(at.distance_mm);
    if (factor == 0.0) return false;
    const std::size_t index = grid_.index(i, j, k);
    const Vec3 value = sign_ * factor * geometry::value_at(at, u_);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      out_.field.ras_mm[3 * index + axis] =
          static_cast<float>(value[static_cast<Eigen::Index>(axis)]);
    }
    if (!inside) return false;
    out_.jacobian.values[index] = static_cast<float>(ratios_[at.tet]);
    const auto sample = [&](const VecX& values, io::ScalarVolume& out) {
      if (values.size() > 0) out.values[index] = static_cast<float>(geometry::value_at(at, values));
    };
    sample(of_.sd_mm, out_.sd_mm);
    sample(of_.known, out_.known);
    return true;
  }

  geometry::TetLocator locator_;
  VecX ratios_;
  const Points& u_;
  const Uncertainty& of_;
  const OutsideTaper& taper_;
  FieldSamples& out_;
  const io::VoxelGrid& grid_;
  double sign_;
};

Status check_invertible(const TetMesh& mesh, const Points& u) {
  const auto folded = (volume_ratios(mesh, u).array() <= 0.0).count();
  if (folded == 0) return {};
  return invalid(
      fmt::format("the displacement turns {} of {} elements inside out: it has no inverse, "
                  "hence no direction resampling; modeling can be had",
                  folded, mesh.num_tets()));
}

double largest_norm(const std::vector<float>& vectors) {
  double largest = 0.0;
  for (std::size_t i = 0; i + 2 < vectors.size(); i += 3) {
    largest = std::max(largest, Vec3(vectors[i], vectors[i + 1], vectors[i + 2]).norm());
  }
  return largest;
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

VecX volume_ratios(const TetMesh& mesh, const Points& u) {
  const Points after = mesh.nodes + u;
  VecX ratios(mesh.num_tets());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    ratios[t] = six_volumes(after, mesh.tets.col(t)) / six_volumes(mesh.nodes, mesh.tets.col(t));
  }
  return ratios;
}

Result<FieldSamples> sample_field(const TetMesh& mesh, const Points& u, const Uncertainty& of,
                                  const io::VoxelGrid& grid, FieldDirection direction,
                                  const OutsideTaper& taper, const Progress& progress) {
  if (Status ok = validate(grid); !ok) return tl::unexpected(ok.error());
  if (Status ok = validate(taper); !ok) return tl::unexpected(ok.error());
  if (!u.allFinite() || !of.sd_mm.allFinite() || !of.known.allFinite()) {
    return fail(ErrorCode::kNotFinite, "the displacement or its uncertainty is not finite");
  }
  if (direction == FieldDirection::kResampling) {
    if (Status ok = check_invertible(mesh, u); !ok) return tl::unexpected(ok.error());
  }
  FieldSamples out;
  out.field = {grid, direction, std::vector<float>(3 * grid.num_voxels(), 0.0F), ""};
  out.jacobian = {grid, std::vector<float>(grid.num_voxels(), 1.0F), ""};
  out.sd_mm.grid = out.known.grid = grid;
  if (of.sd_mm.size() > 0) out.sd_mm.values.assign(grid.num_voxels(), 0.0F);
  if (of.known.size() > 0) out.known.values.assign(grid.num_voxels(), 0.0F);

  const Sampling sampling(mesh, u, of, taper, out);
  ThreadTeam team;
  std::atomic<std::size_t> inside{0};
  const long rows = (grid.dims[1] + kBlock - 1) / kBlock;
  for (int k = 0; k < grid.dims[2]; k += kBlock) {
    team.split(rows, [&](long begin, long end) {
      for (long row = begin; row < end; ++row) {
        for (int i = 0; i < grid.dims[0]; i += kBlock) {
          inside += sampling.block(i, static_cast<int>(row) * kBlock, k);
        }
      }
    });
    report(progress, "sampling the field",
           std::min(1.0, static_cast<double>(k + kBlock) / grid.dims[2]));
  }
  out.voxels_inside = inside;
  out.largest_mm = largest_norm(out.field.ras_mm);
  return out;
}

}  // namespace brainshift::client
