// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/view/volumes.hpp"

#include <gmock/gmock.h>

#include <cstring>

#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"

namespace brainshift::client {
namespace {

BrainModel box() {
  BrainModel model;
  model.mesh = test_support::box_mesh(Vec3(0, 0, 0), Vec3(20, 30, 16), 4);
  return model;
}

template <typename Number>
Number number_at(const std::string& bytes, std::size_t offset, std::size_t index) {
  Number number;
  std::memcpy(&number, bytes.data() + offset + index * sizeof number, sizeof number);
  return number;
}

TEST(FieldVolume, HoldsTheFieldToHalfAStepOfItsNumbers) {
  const BrainModel model = box();
  const FieldVolume volume = FieldVolume::build(model).value();
  const Points& x = model.mesh.nodes;
  Points u(3, x.cols());
  u.row(0) = 0.1 * x.row(0);
  u.row(1) = -0.2 * x.row(1);
  u.row(2).setConstant(3.0);
  const VecX sd = 0.05 * x.row(0).transpose();
  const VecX known = x.row(1).transpose() / 30.0;
  const auto encoded = volume.encode(u, sd, known);
  const FieldGrid& grid = volume.grid();
  const std::size_t count = grid.num_voxels();
  ASSERT_EQ(encoded.bytes.size(), 9 * count);
  EXPECT_LT(encoded.grid_error_mm, 1e-5);  // linear
  std::size_t inside = 0;
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      for (int i = 0; i < grid.dims[0]; ++i) {
        const std::size_t v = grid.index(i, j, k);
        if (volume.inside()[v] == 0) {
          EXPECT_EQ(number_at<std::uint16_t>(encoded.bytes, 6 * count, v), 65535);
          EXPECT_EQ(number_at<std::uint8_t>(encoded.bytes, 8 * count, v), 255);
          continue;
        }
        ++inside;
        const Vec3 at = grid.voxel_mm(i, j, k);
        for (std::size_t c = 0; c < 3; ++c) {
          const double mm = number_at<std::int16_t>(encoded.bytes, 0, 3 * v + c) / 512.0;
          const double want = c == 0 ? 0.1 * at[0] : c == 1 ? -0.2 * at[1] : 3.0;
          EXPECT_NEAR(mm, want, 0.6 / 512.0);
        }
        EXPECT_NEAR(number_at<std::uint16_t>(encoded.bytes, 6 * count, v), 50.0 * at[0], 0.6);
        EXPECT_NEAR(number_at<std::uint8_t>(encoded.bytes, 8 * count, v), 250.0 * at[1] / 30.0,
                    0.6);
      }
    }
  }
  EXPECT_NEAR(static_cast<double>(inside), 20 * 30 * 16 / 8, 500.0);
}

TEST(FieldVolume, WithoutUncertaintySaysThatThereIsNone) {
  const BrainModel model = box();
  const FieldVolume volume = FieldVolume::build(model).value();
  const auto encoded = volume.encode(Points::Zero(3, model.mesh.num_nodes()), {}, {});
  EXPECT_EQ(encoded.bytes.find_first_not_of('\xff', 6 * volume.grid().num_voxels()),
            std::string::npos);
}

TEST(GreyVolume, IsTheMriInRasWhateverItsAxes) {
  VoxelImage mri;
  mri.dims = {40, 50, 40};
  mri.T_ras_voxel.linear().diagonal() = Vec3(-1, 1, 1);  // x leftwards
  mri.T_ras_voxel.translation() = Vec3(29, -10, -10);
  for (int k = 0; k < 40; ++k) {
    for (int j = 0; j < 50; ++j) {
      for (int i = 0; i < 40; ++i) mri.values.push_back(100.0F + 5.0F * static_cast<float>(29 - i));
    }
  }
  const GreyVolume grey = grey_volume(mri, box().mesh.nodes).value();
  const auto at = [&](double x) {
    const int i = static_cast<int>(std::lround((x - grey.grid.origin_mm[0]) / 1.0));
    return static_cast<unsigned char>(grey.voxels[grey.grid.index(i, 10, 10)]);
  };
  EXPECT_LT(at(0.0), at(10.0));
  EXPECT_LT(at(10.0), at(20.0));
  EXPECT_EQ(grey.voxels.size(), grey.grid.num_voxels());
}

TEST(GreyVolume, AnMriElsewhereIsRefused) {
  VoxelImage mri;
  mri.dims = {2, 2, 2};
  mri.values.assign(8, 1.0F);
  mri.T_ras_voxel.translation() = Vec3(500, 0, 0);
  EXPECT_THAT(refusal_of(grey_volume(mri, box().mesh.nodes), ErrorCode::kEmptySet),
              testing::HasSubstr("zero all over the brain"));
}

}  // namespace
}  // namespace brainshift::client
