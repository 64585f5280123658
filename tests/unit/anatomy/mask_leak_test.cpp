// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/anatomy/mask_leak.hpp"

#include <gtest/gtest.h>

namespace brainshift::anatomy {
namespace {

// 1 where `is` holds at a place, mm RAS; voxels of 2 mm.
template <typename Is>
VoxelImage drawn(const Is& is) {
  VoxelImage mask;
  mask.dims = {70, 90, 70};
  mask.T_ras_voxel.linear() *= 2.0;
  mask.T_ras_voxel.translation() = Vec3(-70, -80, -70);
  for (int k = 0; k < mask.dims[2]; ++k)
    for (int j = 0; j < mask.dims[1]; ++j)
      for (int i = 0; i < mask.dims[0]; ++i) {
        mask.values.push_back(is(mask.T_ras_voxel * Vec3(i, j, k)) ? 1.0F : 0.0F);
      }
  return mask;
}

bool in_brain(const Vec3& x) { return x.cwiseQuotient(Vec3(60, 70, 60)).norm() < 1.0; }

bool in_tube(const Vec3& x, double radius) {
  return Vec3(x.x() - 20, 0, x.z()).norm() < radius && x.y() > 0.0 && x.y() < 85.0;
}

TEST(MaskLeak, ABallOnAThinStalkHangsAndABrainOrAThickStemDoesNot) {
  EXPECT_LT(mask_leak(drawn(in_brain)).volume_mm3, 500.0);
  const Vec3 orbit(20, 84, 0);
  const MaskLeak leak = mask_leak(drawn(
      [&](const Vec3& x) { return in_brain(x) || (x - orbit).norm() < 14.0 || in_tube(x, 4.0); }));
  EXPECT_NEAR(leak.volume_mm3, 4.19 * 14.0 * 14.0 * 14.0, 0.25 * 4.19 * 14.0 * 14.0 * 14.0);
  EXPECT_GT(leak.volume_mm3, kLeak_mm3);
  EXPECT_LT((leak.centre - orbit).norm(), 4.0);
  const VoxelImage stem = drawn([](const Vec3& x) { return in_brain(x) || in_tube(x, 16.0); });
  EXPECT_LT(mask_leak(stem).volume_mm3, 1000.0);
}

TEST(MaskLeak, AThinShellThatBridgesJoinHangs) {
  const VoxelImage shell = drawn([](const Vec3& x) {
    const double r = x.cwiseQuotient(Vec3(60, 70, 60)).norm();
    const bool cap = x.z() > 30.0 && r > 1.08 && r < 1.16;
    return r < 1.0 || cap || (x.z() > 0.0 && Vec3(x.x(), x.y(), 0).norm() < 4.0 && r < 1.16);
  });
  EXPECT_GT(mask_leak(shell).volume_mm3, kLeak_mm3);
}

}  // namespace
}  // namespace brainshift::anatomy
