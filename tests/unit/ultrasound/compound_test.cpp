// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/compound.hpp"
#include "tests/support/results.hpp"

#include <gmock/gmock.h>

#include <numeric>

namespace brainshift::test_support {
namespace {

using testing::HasSubstr;
using tracking::Recording;

// Images of 4 x 3 pixels whose grey value is a linear function of the place in space:
// f(x) = 10 + 3 x + 5 y + 7 z.
double field(const Vec3& x) { return 10.0 + x.dot(Vec3(3, 5, 7)); }

struct Sweep {
  Recording recording;
  ImagePoses poses;
};

Sweep sweep(double offset_mm) {
  Sweep result;
  result.recording.width = 4, result.recording.height = 3;
  for (int frame = 0; frame < 5; ++frame) {
    AffineTransform T = AffineTransform::Identity();
    T.translation() = Vec3(offset_mm, offset_mm, frame + offset_mm);
    result.poses.push_back(T);
    result.recording.time_s.push_back(frame);
    result.recording.image_ok.push_back(1);
    for (int v = 0; v < 3; ++v) {
      for (int u = 0; u < 4; ++u) {
        result.recording.pixels += static_cast<char>(std::lround(field(Vec3(u, v, frame))));
      }
    }
  }
  return result;
}

constexpr PixelWindow kAllFrames{0, 0, 4, 3};

TEST(EnclosingGrid, BeginsAtTheCornerAndCoversTheFrames) {
  const Sweep s = sweep(0.25);
  const auto grid =
      value_or_fail(enclosing_grid(s.recording, s.poses, kAllFrames, Vec3(0.5, 0.5, 0.5)));
  EXPECT_LT((grid.origin_mm - Vec3(0.25, 0.25, 0.25)).norm(), 1e-12);
  EXPECT_THAT(grid.dims, testing::ElementsAre(6, 4, 8));
}

TEST(Compound, OnTheGridPutsEveryPixelIntoItsVoxel) {
  const Sweep s = sweep(0.0);
  const VolumeGrid grid{{4, 3, 5}, Vec3::Zero(), Vec3::Ones()};
  for (const Paste paste : {Paste::kNearest, Paste::kLinear}) {
    const auto volume = value_or_fail(compound(s.recording, s.poses, kAllFrames, grid, paste));
    for (int k = 0; k < 5; ++k) {
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 4; ++i) {
          EXPECT_FLOAT_EQ(volume.image.at(i, j, k), static_cast<float>(field(Vec3(i, j, k))));
        }
      }
    }
    EXPECT_FLOAT_EQ(std::accumulate(volume.weight.begin(), volume.weight.end(), 0.0F), 60.0F);
  }
}

TEST(Compound, OffTheGridLinearSplatKeepsALinearFieldInside) {
  // Pixels lie half-way between voxels. Inside, the weights are symmetric about the voxel, so the
  // mean is the field there.
  const Sweep s = sweep(0.5);
  const VolumeGrid grid{{5, 4, 6}, Vec3::Zero(), Vec3::Ones()};
  const auto volume =
      value_or_fail(compound(s.recording, s.poses, kAllFrames, grid, Paste::kLinear));
  for (int k = 1; k < 5; ++k) {
    for (int j = 1; j < 3; ++j) {
      for (int i = 1; i < 4; ++i) {
        EXPECT_NEAR(volume.image.at(i, j, k), field(Vec3(i, j, k) - Vec3::Constant(0.5)), 1e-4);
      }
    }
  }
  // Every pixel's weight is in the volume.
  EXPECT_NEAR(std::accumulate(volume.weight.begin(), volume.weight.end(), 0.0F), 60.0F, 1e-3);
}

TEST(Compound, TakesTheMeanOfFramesThatOverlap) {
  Sweep s = sweep(0.0);
  for (auto& T : s.poses) T->translation().setZero();
  const VolumeGrid grid{{4, 3, 1}, Vec3::Zero(), Vec3::Ones()};
  const auto volume = value_or_fail(compound(s.recording, s.poses, kAllFrames, grid));
  EXPECT_FLOAT_EQ(volume.image.at(1, 2, 0), static_cast<float>(field(Vec3(1, 2, 2))));
  EXPECT_FLOAT_EQ(volume.weight[9], 5.0F);
}

TEST(Compound, LeavesOutFramesWithoutAPoseAndPixelsOutsideTheWindow) {
  Sweep s = sweep(0.0);
  s.poses[2].reset();
  const VolumeGrid grid{{4, 3, 5}, Vec3::Zero(), Vec3::Ones()};
  const auto volume = value_or_fail(compound(s.recording, s.poses, {1, 1, 2, 10}, grid));
  for (int k = 0; k < 5; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 4; ++i) {
        const bool filled = k != 2 && i >= 1 && i <= 2 && j >= 1;
        EXPECT_EQ(volume.weight[static_cast<std::size_t>(i + 4 * (j + 3 * k))] > 0.0F, filled);
      }
    }
  }
}

TEST(Compound, RefusesWhatCannotBeDone) {
  const Sweep s = sweep(0.0);
  const VolumeGrid grid{{4, 3, 5}, Vec3::Zero(), Vec3::Ones()};
  auto volume = compound(s.recording, {}, kAllFrames, grid);
  EXPECT_THAT(sentence_of(volume), HasSubstr("0 poses for 5 frames"));
  volume = compound(s.recording, s.poses, {10, 0, 5, 5}, grid);
  EXPECT_THAT(sentence_of(volume), HasSubstr("clip rectangle at 10 0"));
  volume = compound(s.recording, s.poses, kAllFrames, {{0, 3, 5}, Vec3::Zero(), Vec3::Ones()});
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, HasSubstr("volume of 0 x 3 x 5 voxels"));
  EXPECT_FALSE(enclosing_grid(s.recording, s.poses, kAllFrames, Vec3(1e-6, 1e-6, 1e-6)));
  EXPECT_FALSE(enclosing_grid(s.recording, s.poses, kAllFrames, Vec3(1, 0, 1)));
  refusal_of(enclosing_grid(s.recording, ImagePoses(5), kAllFrames, Vec3::Ones()),
             ErrorCode::kEmptySet);
}

}  // namespace
}  // namespace brainshift::test_support
