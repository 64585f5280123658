// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/anatomy/mask_leak.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/geometry/mask.hpp"

namespace brainshift::anatomy {
namespace {

constexpr double kVoxel_mm = 2.0, kSulcus_mm = 3.0, kNeck_mm = 6.0, kBack_mm = 8.0;

// Every nth voxel, with a margin of zeros that no step below leaves.
VoxelImage coarse(const VoxelImage& mask) {
  constexpr int kMargin = 6;
  std::array<int, 3> every{};
  VoxelImage image;
  image.T_ras_voxel = mask.T_ras_voxel;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    const double step = mask.T_ras_voxel.linear().col(axis).norm();
    every[a] = std::max(1, static_cast<int>(std::lround(kVoxel_mm / step)));
    image.dims[a] = (mask.dims[a] + every[a] - 1) / every[a] + 2 * kMargin;
    image.T_ras_voxel.linear().col(axis) *= every[a];
  }
  image.T_ras_voxel.translation() -= image.T_ras_voxel.linear() * Vec3::Constant(kMargin);
  image.values.assign(image.num_voxels(), 0.0F);
  for (int k = 0; k * every[2] < mask.dims[2]; ++k)
    for (int j = 0; j * every[1] < mask.dims[1]; ++j)
      for (int i = 0; i * every[0] < mask.dims[0]; ++i) {
        const bool in = mask.at(i * every[0], j * every[1], k * every[2]) > 0.0F;
        image.values[grid_index(image.dims, i + kMargin, j + kMargin, k + kMargin)] =
            in ? 1.0F : 0.0F;
      }
  return image;
}

// 1 where a voxel > 0 lies within radius_mm.
VoxelImage spread(const VoxelImage& image, double radius_mm) {
  std::vector<std::array<int, 3>> ball;
  const Mat3 mm = image.T_ras_voxel.linear();
  const int reach = static_cast<int>(std::ceil(radius_mm / mm.colwise().norm().minCoeff()));
  for (int k = -reach; k <= reach; ++k)
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        if ((mm * Vec3(i, j, k)).norm() <= radius_mm) ball.push_back({i, j, k});
      }
  const auto& dims = image.dims;
  const auto in_image = [&dims](int i, int j, int k) {
    return i >= 0 && j >= 0 && k >= 0 && i < dims[0] && j < dims[1] && k < dims[2];
  };
  const auto in = [&](int i, int j, int k) {
    return in_image(i, j, k) && image.at(i, j, k) > 0.0F;
  };
  VoxelImage result = image;
  for (int k = 0; k < dims[2]; ++k)
    for (int j = 0; j < dims[1]; ++j)
      for (int i = 0; i < dims[0]; ++i) {
        if (!in(i, j, k)) continue;
        const bool deep = in(i - 1, j, k) && in(i + 1, j, k) && in(i, j - 1, k) &&
                          in(i, j + 1, k) && in(i, j, k - 1) && in(i, j, k + 1);
        if (deep) continue;
        for (const auto& [di, dj, dk] : ball) {
          if (!in_image(i + di, j + dj, k + dk)) continue;
          result.values[grid_index(dims, i + di, j + dj, k + dk)] = 1.0F;
        }
      }
  return result;
}

VoxelImage complement(VoxelImage image) {
  for (float& v : image.values) v = v > 0.0F ? 0.0F : 1.0F;
  return image;
}

// 1 where the largest part is.
VoxelImage largest_part(VoxelImage image) {
  const geometry::MaskParts parts = geometry::mask_parts(image);
  for (std::size_t v = 0; v < image.values.size(); ++v) {
    image.values[v] = parts.part_of_voxel[v] == 0 ? 1.0F : 0.0F;
  }
  return image;
}

}  // namespace

MaskLeak mask_leak(const VoxelImage& mask) {
  const VoxelImage whole = geometry::close_gaps(coarse(mask), kSulcus_mm);
  const VoxelImage core = largest_part(complement(spread(complement(whole), kNeck_mm)));
  const VoxelImage body = spread(core, kBack_mm);
  VoxelImage rest = whole;
  for (std::size_t v = 0; v < rest.values.size(); ++v) {
    if (body.values[v] > 0.0F) rest.values[v] = 0.0F;
  }
  const geometry::MaskCentre part = geometry::mask_centre(largest_part(std::move(rest)));
  return {part.volume_mm3, part.centre};
}

}  // namespace brainshift::anatomy
