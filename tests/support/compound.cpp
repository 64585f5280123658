// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/compound.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace brainshift::test_support {
namespace {

constexpr double kMaxVoxels = 1 << 30;

Status check_grid(const VolumeGrid& grid) {
  double voxels = 1.0;
  for (const int size : grid.dims) voxels *= std::max(size, 0);
  const bool positive = grid.spacing_mm.allFinite() && grid.spacing_mm.minCoeff() > 0.0;
  if (voxels >= 1.0 && voxels <= kMaxVoxels && positive) return {};
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("volume of {} x {} x {} voxels with spacing {} {} {} mm: must have 1 to "
                          "2^30 voxels and a positive spacing",
                          grid.dims[0], grid.dims[1], grid.dims[2], grid.spacing_mm.x(),
                          grid.spacing_mm.y(), grid.spacing_mm.z()));
}

// The part of the window that lies in the image.
Result<PixelWindow> clip(const PixelWindow& window, const tracking::Recording& recording) {
  PixelWindow inside;
  inside.left = std::max(window.left, 0);
  inside.top = std::max(window.top, 0);
  inside.width = std::min(window.left + window.width, recording.width) - inside.left;
  inside.height = std::min(window.top + window.height, recording.height) - inside.top;
  if (inside.width > 0 && inside.height > 0) return inside;
  return fail(
      ErrorCode::kInvalidArgument,
      fmt::format("clip rectangle at {} {} of {} x {} pixels lies outside the image of {} x "
                  "{} pixels",
                  window.left, window.top, window.width, window.height, recording.width,
                  recording.height));
}

class Sums {
 public:
  Sums(const VolumeGrid& grid, CompoundedVolume& volume) : dims_(grid.dims), volume_(volume) {}

  void add(const std::array<int, 3>& at, float weight, float value) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (at[axis] < 0 || at[axis] >= dims_[axis]) return;
    }
    const std::size_t voxel =
        static_cast<std::size_t>(at[0]) +
        static_cast<std::size_t>(dims_[0]) *
            (static_cast<std::size_t>(at[1]) +
             static_cast<std::size_t>(dims_[1]) * static_cast<std::size_t>(at[2]));
    volume_.image.values[voxel] += weight * value;
    volume_.weight[voxel] += weight;
  }

  void add_linear(const Vec3& at, float value) {
    const Vec3 base = at.array().floor();
    const Vec3 part = at - base;
    for (int corner = 0; corner < 8; ++corner) {
      std::array<int, 3> voxel{};
      double weight = 1.0;
      for (int axis = 0; axis < 3; ++axis) {
        const int upper = corner >> axis & 1;
        voxel[static_cast<std::size_t>(axis)] = static_cast<int>(base[axis]) + upper;
        weight *= upper == 1 ? part[axis] : 1.0 - part[axis];
      }
      if (weight > 0.0) add(voxel, static_cast<float>(weight), value);
    }
  }

 private:
  std::array<int, 3> dims_;
  CompoundedVolume& volume_;
};

void paste_frame(const Eigen::MatrixXf& pixels, const PixelWindow& window,
                 const AffineTransform& T_voxel_image, Paste paste, const VolumeGrid& grid,
                 Sums& sums) {
  const Vec3 along_u = T_voxel_image.linear().col(0);
  for (int v = window.top; v < window.top + window.height; ++v) {
    Vec3 at = T_voxel_image * Vec3(window.left, v, 0.0);
    for (int u = window.left; u < window.left + window.width; ++u, at += along_u) {
      // Far pixels must not overflow an int.
      bool near = true;
      for (int axis = 0; axis < 3; ++axis) {
        near = near && at[axis] > -1.0 && at[axis] < grid.dims[static_cast<std::size_t>(axis)];
      }
      if (!near) continue;
      if (paste == Paste::kLinear) {
        sums.add_linear(at, pixels(v, u));
      } else {
        const Vec3 voxel = (at.array() + 0.5).floor();
        sums.add(
            {static_cast<int>(voxel.x()), static_cast<int>(voxel.y()), static_cast<int>(voxel.z())},
            1.0F, pixels(v, u));
      }
    }
  }
}

}  // namespace

Result<VolumeGrid> enclosing_grid(const tracking::Recording& recording, const ImagePoses& poses,
                                  const PixelWindow& window, const Vec3& spacing_mm) {
  const auto inside = clip(window, recording);
  if (!inside) return tl::unexpected(inside.error());
  Eigen::AlignedBox3d box;
  for (const auto& T_target_image : poses) {
    if (!T_target_image) continue;
    for (const int u : {inside->left, inside->left + inside->width - 1}) {
      for (const int v : {inside->top, inside->top + inside->height - 1}) {
        box.extend(*T_target_image * Vec3(u, v, 0.0));
      }
    }
  }
  if (box.isEmpty()) return fail(ErrorCode::kEmptySet, "no frame has a pose: nothing to compound");
  VolumeGrid grid;
  grid.origin_mm = box.min();
  grid.spacing_mm = spacing_mm;
  for (int axis = 0; axis < 3; ++axis) {
    const double steps = std::ceil(box.sizes()[axis] / spacing_mm[axis]);
    const bool fits = steps >= 0.0 && steps < kMaxVoxels;
    grid.dims[static_cast<std::size_t>(axis)] = fits ? std::max(1, static_cast<int>(steps)) : 0;
  }
  if (Status ok = check_grid(grid); !ok) return tl::unexpected(ok.error());
  return grid;
}

Result<CompoundedVolume> compound(const tracking::Recording& recording, const ImagePoses& poses,
                                  const PixelWindow& window, const VolumeGrid& grid, Paste paste) {
  if (static_cast<int>(poses.size()) != recording.num_frames()) {
    return fail(ErrorCode::kInvalidArgument, fmt::format("{} poses for {} frames: must agree",
                                                         poses.size(), recording.num_frames()));
  }
  if (Status ok = check_grid(grid); !ok) return tl::unexpected(ok.error());
  const auto inside = clip(window, recording);
  if (!inside) return tl::unexpected(inside.error());

  CompoundedVolume volume;
  volume.image.dims = grid.dims;
  AffineTransform T_target_voxel = AffineTransform::Identity();
  T_target_voxel.linear() = grid.spacing_mm.asDiagonal();
  T_target_voxel.translation() = grid.origin_mm;
  volume.image.T_ras_voxel = T_target_voxel;
  volume.image.values.assign(volume.image.num_voxels(), 0.0F);
  volume.weight.assign(volume.image.num_voxels(), 0.0F);
  Sums sums(grid, volume);
  for (int frame = 0; frame < recording.num_frames(); ++frame) {
    const auto& T_target_image = poses[static_cast<std::size_t>(frame)];
    if (!T_target_image) continue;
    paste_frame(recording.frame_values(frame), *inside, T_target_voxel.inverse() * *T_target_image,
                paste, grid, sums);
  }
  for (std::size_t i = 0; i < volume.weight.size(); ++i) {
    if (volume.weight[i] > 0.0F) volume.image.values[i] /= volume.weight[i];
  }
  return volume;
}

}  // namespace brainshift::test_support
