// SPDX-License-Identifier: GPL-3.0-or-later
// A field on an oblique, anisotropic, flipped grid of 5 x 4 x 3 voxels; every value differs.
#pragma once

#include <Eigen/Geometry>

#include "common/io/fields/displacement_field.hpp"

namespace brainshift::io {

inline VoxelGrid oblique_grid() {
  VoxelGrid grid;
  grid.dims = {5, 4, 3};
  Mat3 axes = (Eigen::AngleAxisd(0.4, Vec3::UnitX()) * Eigen::AngleAxisd(-0.3, Vec3::UnitY()) *
               Eigen::AngleAxisd(2.5, Vec3::UnitZ()))
                  .toRotationMatrix();
  axes.col(1) *= -1.0;
  grid.T_ras_voxel.linear() = axes * Vec3(1.0, 1.5, 2.5).asDiagonal();
  grid.T_ras_voxel.translation() = Vec3(-12.5, 30.25, 7.0);
  return grid;
}

inline DisplacementField small_field() {
  DisplacementField field{oblique_grid(), FieldDirection::kResampling, {}, "update 7, good"};
  for (int i = 0; i < 3 * 5 * 4 * 3; ++i)
    field.ras_mm.push_back(0.25F * static_cast<float>(i) - 20);
  return field;
}

inline ScalarVolume small_volume() {
  ScalarVolume volume{oblique_grid(), {}, "sd"};
  for (int i = 0; i < 5 * 4 * 3; ++i) volume.values.push_back(0.5F * static_cast<float>(i));
  return volume;
}

}  // namespace brainshift::io
