// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/volume/grid_sampler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/thread_team.hpp"

namespace brainshift::client {
namespace {

constexpr double kMaxFade_mm = 1000.0;

// 0 in the rim, 1 from fade_mm inwards. With fade_mm 0 every voxel inside the rim has 1.
double fade_factor(double rim_distance_mm, double fade_mm) {
  if (rim_distance_mm >= fade_mm) return 1.0;
  return 0.5 * (1.0 - std::cos(std::numbers::pi * rim_distance_mm / fade_mm));
}

// Of a voxel's centre, to the nearest voxel of the rim along an axis.
double rim_distance_mm(const FieldGrid& grid, int i, int j, int k) {
  const int steps =
      std::min({i, j, k, grid.dims[0] - 1 - i, grid.dims[1] - 1 - j, grid.dims[2] - 1 - k});
  return steps * grid.spacing_mm;
}

// The eight voxels around a point inside the grid: the lowest one and the place between them.
struct Cell {
  Eigen::Array3i low;
  Eigen::Array3d part;  // 0 to 1 along every axis
};
Cell cell_at(const FieldGrid& grid, const Vec3& x) {
  const Eigen::Array3d place = ((x - grid.origin_mm) / grid.spacing_mm).array();
  Cell cell;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = grid.dims[static_cast<std::size_t>(axis)] - 2;
    cell.low[axis] = std::clamp(static_cast<int>(std::floor(place[axis])), 0, last);
    cell.part[axis] = place[axis] - cell.low[axis];
  }
  return cell;
}

Vec3 trilinear(const FieldGrid& grid, const float* xyz, const Vec3& x) {
  const Cell cell = cell_at(grid, x);
  Vec3 value = Vec3::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    Eigen::Array3i at = cell.low;
    for (int axis = 0; axis < 3; ++axis) {
      const bool high = ((corner >> axis) & 1) != 0;
      weight *= high ? cell.part[axis] : 1.0 - cell.part[axis];
      if (high) ++at[axis];
    }
    const float* vector = xyz + 3 * grid.index(at[0], at[1], at[2]);
    value += weight * Vec3(vector[0], vector[1], vector[2]);
  }
  return value;
}

}  // namespace

Result<GridSampler> GridSampler::build(const geometry::TetLocator& mesh, const FieldGrid& grid,
                                       const SamplerOptions& options) {
  if (auto ok = validate(grid); !ok) return tl::unexpected(ok.error());
  if (auto ok = validate(options.taper); !ok) return tl::unexpected(ok.error());
  if (!(options.fade_mm >= 0.0 && options.fade_mm <= kMaxFade_mm)) {
    return invalid(fmt::format("fade before the rim = {} mm: must be in [0, {}]", options.fade_mm,
                               kMaxFade_mm));
  }
  if (mesh.tets().cols() == 0) return fail(ErrorCode::kEmptySet, "mesh: it has no tetrahedron");
  GridSampler sampler;
  sampler.grid_ = grid;
  sampler.mesh_nodes_ = static_cast<int>(mesh.nodes().cols());
  sampler.find_gathers(mesh, options);
  sampler.find_interior(mesh, options.fade_mm);
  sampler.find_nodes_used();
  return sampler;
}

void GridSampler::find_gathers(const geometry::TetLocator& mesh, const SamplerOptions& options) {
  // Slices are shared out in fixed parts, and put together in order: the result depends on no
  // timing.
  struct Slice {
    std::vector<Gather> inside, outside;
  };
  const FieldGrid& grid = grid_;
  std::vector<Slice> slices(static_cast<std::size_t>(grid.dims[2]));
  ThreadTeam team;
  team.split(grid.dims[2], [&](long begin, long end) {
    for (int k = std::max(static_cast<int>(begin), 1); k < end && k < grid.dims[2] - 1; ++k) {
      Slice& slice = slices[static_cast<std::size_t>(k)];
      for (int j = 1; j < grid.dims[1] - 1; ++j) {
        for (int i = 1; i < grid.dims[0] - 1; ++i) {
          const auto at = mesh.locate(grid.voxel_mm(i, j, k));
          const bool inside = at.distance_mm == 0.0;
          const double scale = fade_factor(rim_distance_mm(grid, i, j, k), options.fade_mm) *
                               options.taper.factor(at.distance_mm);
          if (scale == 0.0) continue;
          Gather gather;
          gather.voxel = static_cast<std::uint32_t>(grid.index(i, j, k));
          gather.scale = static_cast<float>(scale);
          for (int corner = 0; corner < 4; ++corner) {
            gather.nodes[corner] = at.nodes[corner];
            gather.weights[corner] = static_cast<float>(at.weights[corner]);
          }
          (inside ? slice.inside : slice.outside).push_back(gather);
        }
      }
    }
  });
  for (const Slice& slice : slices) {
    inside_.insert(inside_.end(), slice.inside.begin(), slice.inside.end());
    outside_.insert(outside_.end(), slice.outside.begin(), slice.outside.end());
  }
}

void GridSampler::find_interior(const geometry::TetLocator& mesh, double fade_mm) {
  for (NodeIndex node = 0; node < mesh_nodes_; ++node) {
    const Vec3 x = mesh.nodes().col(node);
    const Vec3 low = x - grid_.origin_mm, high = grid_.last_mm() - x;
    // Every voxel around the node is at least fade_mm, and a voxel, from the rim.
    const double from_rim_mm = std::min(low.minCoeff(), high.minCoeff()) - grid_.spacing_mm;
    if (from_rim_mm >= std::max(fade_mm, grid_.spacing_mm)) interior_.push_back(node);
  }
  interior_mm_ = mesh.nodes()(Eigen::all, interior_);
}

void GridSampler::find_nodes_used() {
  std::vector<char> used(static_cast<std::size_t>(mesh_nodes_), 0);
  for (const auto* gathers : {&inside_, &outside_}) {
    for (const Gather& gather : *gathers) {
      for (const std::int32_t node : gather.nodes) used[static_cast<std::size_t>(node)] = 1;
    }
  }
  for (const NodeIndex node : interior_) used[static_cast<std::size_t>(node)] = 1;
  for (NodeIndex node = 0; node < mesh_nodes_; ++node) {
    if (used[static_cast<std::size_t>(node)] != 0) nodes_used_.push_back(node);
  }
}

void GridSampler::sample(const Points& u, float* xyz) const {
  std::fill_n(xyz, 3 * grid_.num_voxels(), 0.0F);
  for (const auto* gathers : {&inside_, &outside_}) {
    for (const Gather& gather : *gathers) {
      Vec3 value = Vec3::Zero();
      for (int corner = 0; corner < 4; ++corner) {
        value += static_cast<double>(gather.weights[corner]) * u.col(gather.nodes[corner]);
      }
      value *= static_cast<double>(gather.scale);
      float* vector = xyz + 3 * static_cast<std::size_t>(gather.voxel);
      for (int axis = 0; axis < 3; ++axis) vector[axis] = static_cast<float>(value[axis]);
    }
  }
}

void GridSampler::sample_scalar(const VecX& values, float* out) const {
  std::fill_n(out, grid_.num_voxels(), 0.0F);
  for (const Gather& gather : inside_) {
    double value = 0.0;
    for (int corner = 0; corner < 4; ++corner) {
      value += static_cast<double>(gather.weights[corner]) * values[gather.nodes[corner]];
    }
    out[gather.voxel] = static_cast<float>(value);
  }
}

double GridSampler::interpolation_error_mm(const Points& u, const float* xyz) const {
  double worst_mm = 0.0;
  for (std::size_t i = 0; i < interior_.size(); ++i) {
    const NodeIndex node = interior_[i];
    const Vec3 shown = trilinear(grid_, xyz, interior_mm_.col(static_cast<Eigen::Index>(i)));
    worst_mm = std::max(worst_mm, (shown - u.col(node)).norm());
  }
  return worst_mm;
}

}  // namespace brainshift::client
