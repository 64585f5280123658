// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/export/output_grid.hpp"

#include <gmock/gmock.h>

#include "tests/support/box_mesh.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

TEST(OutputGrid, LikeAnImageIsItsAffineAsItIs) {
  VoxelImage image;
  image.dims = {4, 5, 6};
  image.T_ras_voxel.linear() =
      Eigen::AngleAxisd(0.4, Vec3::UnitY()).toRotationMatrix() * Vec3(-1, 2, 3).asDiagonal();
  image.T_ras_voxel.translation() = Vec3(7, 8, 9);
  const auto grid = grid_like(image);
  ASSERT_TRUE(grid) << grid.error().message;
  EXPECT_EQ(grid->dims, image.dims);
  EXPECT_EQ(grid->T_ras_voxel.matrix(), image.T_ras_voxel.matrix());
}

TEST(OutputGrid, AShearedImageIsRefused) {
  VoxelImage image;
  image.dims = {4, 5, 6};
  image.T_ras_voxel.linear()(0, 1) = 0.1;
  EXPECT_THAT(grid_like(image).error().message, HasSubstr("off a right angle"));
}

TEST(OutputGrid, AroundTheBrainHasRoomForTheFieldBeforeAndAfter) {
  const TetMesh mesh = test_support::box_mesh(2, 2, 2, Vec3(40, 50, 60));
  Points u = Points::Zero(3, mesh.num_nodes());
  u.row(0).setConstant(-7.0);
  const OutsideTaper taper{4.0, 10.0};
  const auto grid = grid_around_brain(mesh, u, 1.5, taper);
  ASSERT_TRUE(grid) << grid.error().message;
  EXPECT_EQ(grid->T_ras_voxel.linear(), 1.5 * Mat3::Identity());
  const Vec3 low = grid->voxel_mm(0, 0, 0);
  const Vec3 high = grid->voxel_mm(grid->dims[0] - 1, grid->dims[1] - 1, grid->dims[2] - 1);
  EXPECT_TRUE((low.array() <= Vec3(-17, -10, -10).array()).all()) << low.transpose();
  EXPECT_TRUE((high.array() >= Vec3(50, 60, 70).array()).all()) << high.transpose();
  EXPECT_TRUE((low.array() > Vec3(-17, -10, -10).array() - 4.0).all()) << low.transpose();
  EXPECT_TRUE((high.array() < Vec3(50, 60, 70).array() + 4.0).all()) << high.transpose();
}

TEST(OutputGrid, ASpacingThatIsNoneOrMakesAHugeGridIsRefused) {
  const TetMesh mesh = test_support::box_mesh(1, 1, 1, Vec3(150, 180, 140));
  const Points u = Points::Zero(3, mesh.num_nodes());
  for (const double bad : {0.0, -1.0, 0.01, 101.0, std::nan(""), 0.3}) {
    const auto grid = grid_around_brain(mesh, u, bad);
    ASSERT_FALSE(grid) << bad;
    EXPECT_EQ(grid.error().code, ErrorCode::kInvalidArgument) << grid.error().message;
  }
}

}  // namespace
}  // namespace brainshift::client
