// SPDX-License-Identifier: GPL-3.0-or-later
// Masks of balls with a known surface, in any voxel frame.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/core/mesh.hpp"

namespace brainshift::geometry::balls {

struct Ball {
  Vec3 centre = Vec3::Zero();
  double radius = 1.0;
};

// An image of dims^3 voxels whose middle lies at `middle`, voxel axes = the columns of `axes`.
inline VoxelImage empty_image(int dims, const Vec3& middle, const Mat3& axes) {
  VoxelImage image;
  image.dims = {dims, dims, dims};
  image.T_ras_voxel.linear() = axes;
  image.T_ras_voxel.translation() = middle - axes * Vec3::Constant(0.5 * (dims - 1));
  image.values.assign(image.num_voxels(), 0.0f);
  return image;
}

// Adds value(signed depth below the nearest ball's surface) to every voxel; depth > 0 is inside.
template <typename Value>
VoxelImage paint_balls(VoxelImage image, const std::vector<Ball>& balls, Value value) {
  std::size_t v = 0;
  for (int k = 0; k < image.dims[2]; ++k)
    for (int j = 0; j < image.dims[1]; ++j)
      for (int i = 0; i < image.dims[0]; ++i, ++v) {
        const Vec3 x = image.T_ras_voxel * Vec3(i, j, k);
        double depth = -1e9;
        for (const Ball& ball : balls)
          depth = std::max(depth, ball.radius - (x - ball.centre).norm());
        image.values[v] = value(depth);
      }
  return image;
}

// 1 inside, 0 outside.
inline VoxelImage binary_balls(const VoxelImage& frame, const std::vector<Ball>& balls) {
  return paint_balls(frame, balls, [](double depth) { return depth > 0.0 ? 1.0f : 0.0f; });
}

// Rises linearly from 0 to 1 over `width` mm across the surface, where it is 0.5: trilinear
// interpolation then finds the sphere up to the curvature over one voxel, h^2 / (8 r).
inline VoxelImage soft_balls(const VoxelImage& frame, const std::vector<Ball>& balls,
                             double width) {
  return paint_balls(frame, balls, [width](double depth) {
    return static_cast<float>(std::clamp(0.5 + depth / width, 0.0, 1.0));
  });
}

// Axes turned by an oblique rotation, `spacing` mm apart; left-handed like many scanners' images.
inline Mat3 oblique_left_handed(double spacing) {
  Mat3 axes = Eigen::AngleAxisd(0.6, Vec3(1, -2, 0.5).normalized()).toRotationMatrix() * spacing;
  axes.col(0) *= -1.0;
  return axes;
}

inline double ball_volume(double radius) { return 4.0 / 3.0 * M_PI * radius * radius * radius; }

}  // namespace brainshift::geometry::balls
