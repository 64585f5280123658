// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <numeric>
#include <string>

#include "common/ultrasound/compound.hpp"

namespace brainshift::ultrasound {
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
  const auto grid = enclosing_grid(s.recording, s.poses, kAllFrames, Vec3(0.5, 0.5, 0.5));
  ASSERT_TRUE(grid);
  EXPECT_LT((grid->origin_mm - Vec3(0.25, 0.25, 0.25)).norm(), 1e-12);
  EXPECT_THAT(grid->dims, testing::ElementsAre(6, 4, 8));
}

TEST(Compound, OnTheGridPutsEveryPixelIntoItsVoxel) {
  const Sweep s = sweep(0.0);
  const VolumeGrid grid{{4, 3, 5}, Vec3::Zero(), Vec3::Ones()};
  for (const Paste paste : {Paste::kNearest, Paste::kLinear}) {
    const auto volume = compound(s.recording, s.poses, kAllFrames, grid, paste);
    ASSERT_TRUE(volume);
    for (int k = 0; k < 5; ++k) {
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 4; ++i) {
          EXPECT_FLOAT_EQ(volume->image.at(i, j, k), static_cast<float>(field(Vec3(i, j, k))));
        }
      }
    }
    EXPECT_FLOAT_EQ(std::accumulate(volume->weight.begin(), volume->weight.end(), 0.0F), 60.0F);
  }
}

TEST(Compound, OffTheGridLinearSplatKeepsALinearFieldInside) {
  // Pixels lie half-way between voxels. Inside, the weights are symmetric about the voxel, so the
  // mean is the field there.
  const Sweep s = sweep(0.5);
  const VolumeGrid grid{{5, 4, 6}, Vec3::Zero(), Vec3::Ones()};
  const auto volume = compound(s.recording, s.poses, kAllFrames, grid, Paste::kLinear);
  ASSERT_TRUE(volume);
  for (int k = 1; k < 5; ++k) {
    for (int j = 1; j < 3; ++j) {
      for (int i = 1; i < 4; ++i) {
        EXPECT_NEAR(volume->image.at(i, j, k), field(Vec3(i, j, k) - Vec3::Constant(0.5)), 1e-4);
      }
    }
  }
  // Every pixel's weight is in the volume.
  EXPECT_NEAR(std::accumulate(volume->weight.begin(), volume->weight.end(), 0.0F), 60.0F, 1e-3);
}

TEST(Compound, TakesTheMeanOfFramesThatOverlap) {
  Sweep s = sweep(0.0);
  for (auto& T : s.poses) T->translation().setZero();
  const VolumeGrid grid{{4, 3, 1}, Vec3::Zero(), Vec3::Ones()};
  const auto volume = compound(s.recording, s.poses, kAllFrames, grid);
  ASSERT_TRUE(volume);
  EXPECT_FLOAT_EQ(volume->image.at(1, 2, 0), static_cast<float>(field(Vec3(1, 2, 2))));
  EXPECT_FLOAT_EQ(volume->weight[9], 5.0F);
}

TEST(Compound, LeavesOutFramesWithoutAPoseAndPixelsOutsideTheWindow) {
  Sweep s = sweep(0.0);
  s.poses[2].reset();
  const VolumeGrid grid{{4, 3, 5}, Vec3::Zero(), Vec3::Ones()};
  const auto volume = compound(s.recording, s.poses, {1, 1, 2, 10}, grid);
  ASSERT_TRUE(volume);
  for (int k = 0; k < 5; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 4; ++i) {
        const bool filled = k != 2 && i >= 1 && i <= 2 && j >= 1;
        EXPECT_EQ(volume->weight[static_cast<std::size_t>(i + 4 * (j + 3 * k))] > 0.0F, filled);
      }
    }
  }
}

TEST(Compound, RefusesWhatCannotBeDone) {
  const Sweep s = sweep(0.0);
  const VolumeGrid grid{{4, 3, 5}, Vec3::Zero(), Vec3::Ones()};
  auto volume = compound(s.recording, {}, kAllFrames, grid);
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, HasSubstr("0 poses for 5 frames"));
  volume = compound(s.recording, s.poses, {10, 0, 5, 5}, grid);
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, HasSubstr("clip rectangle at 10 0"));
  volume = compound(s.recording, s.poses, kAllFrames, {{0, 3, 5}, Vec3::Zero(), Vec3::Ones()});
  ASSERT_FALSE(volume);
  EXPECT_THAT(volume.error().message, HasSubstr("volume of 0 x 3 x 5 voxels"));
  EXPECT_FALSE(enclosing_grid(s.recording, s.poses, kAllFrames, Vec3(1e-6, 1e-6, 1e-6)));
  EXPECT_FALSE(enclosing_grid(s.recording, s.poses, kAllFrames, Vec3(1, 0, 1)));
  const auto none = enclosing_grid(s.recording, ImagePoses(5), kAllFrames, Vec3::Ones());
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kEmptySet);
}

using testing::HasSubstr;

constexpr int kWidth = 12, kHeight = 10;

// Pixels left of column 4 are never seen. Elsewhere the value is u + 10 v, except for one dark
// spot in the first frame.
tracking::Recording recording() {
  tracking::Recording made;
  made.width = kWidth;
  made.height = kHeight;
  for (int frame = 0; frame < 2; ++frame) {
    made.time_s.push_back(frame);
    made.image_ok.push_back(1);
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) {
        const bool dark = u < 4 || (frame == 0 && u == 6 && v == 3);
        made.pixels.push_back(static_cast<char>(dark ? 0 : u + 10 * v));
      }
  }
  return made;
}
ImagePoses poses() {
  AffineTransform T = AffineTransform::Identity();
  T.linear().diagonal() = Vec3(0.5, 0.25, 1.0);
  AffineTransform next = T;
  next.translation() = Vec3(0, 0, 3);
  return {T, next};
}
const PixelWindow kAll{0, 0, kWidth, kHeight};

TEST(FrameSamples, AreBlocksOfTheSectorAtTheirPlaces) {
  const auto samples = frame_samples(recording(), poses(), kAll, 2);
  ASSERT_TRUE(samples);
  // Columns 4 to 11 make 4 blocks; rows 0 to 9 make 5.
  ASSERT_EQ(samples->positions.cols(), 2 * 4 * 5);
  ASSERT_EQ(samples->intensities.size(), 2 * 4 * 5);
  EXPECT_TRUE(samples->positions.col(0).isApprox(Vec3(4.5 * 0.5, 0.5 * 0.25, 0.0)));
  EXPECT_DOUBLE_EQ(samples->intensities[0], 4.5 + 10 * 0.5);
  EXPECT_TRUE(samples->positions.col(20 + 19).isApprox(Vec3(10.5 * 0.5, 8.5 * 0.25, 3.0)));
  EXPECT_DOUBLE_EQ(samples->intensities[20 + 19], 10.5 + 10 * 8.5);
}

// Dark in one frame, but not in all: tissue.
TEST(FrameSamples, KeepDarkPixelsInsideTheSector) {
  const auto samples = frame_samples(recording(), poses(), {6, 3, 1, 1}, 1);
  ASSERT_TRUE(samples);
  ASSERT_EQ(samples->intensities.size(), 2);
  EXPECT_EQ(samples->intensities[0], 0.0);
  EXPECT_EQ(samples->intensities[1], 36.0);
}

TEST(FrameSamples, StayInTheWindowAndLeaveOutFramesWithoutAPose) {
  ImagePoses one = poses();
  one[0].reset();
  const auto samples = frame_samples(recording(), one, {5, 2, 100, 4}, 2);
  ASSERT_TRUE(samples);
  EXPECT_EQ(samples->intensities.size(), 3 * 2);
  EXPECT_TRUE((samples->positions.row(2).array() == 3.0).all());
  EXPECT_GE(samples->positions.row(0).minCoeff(), 0.5 * 5);
  tracking::Recording invalid = recording();
  invalid.image_ok[0] = 0;
  EXPECT_EQ(frame_samples(invalid, poses(), {5, 2, 100, 4}, 2)->intensities.size(), 3 * 2);
}

void expect_refused(const Result<IntensitySamples>& samples, ErrorCode code,
                    const std::string& text) {
  ASSERT_FALSE(samples);
  EXPECT_EQ(samples.error().code, code);
  EXPECT_THAT(samples.error().message, HasSubstr(text));
}

TEST(FrameSamples, RefuseWhatIsWrong) {
  expect_refused(frame_samples(recording(), {}, kAll, 2), ErrorCode::kInvalidArgument,
                 "2 frames with 0 poses");
  expect_refused(frame_samples(recording(), poses(), kAll, 0), ErrorCode::kInvalidArgument,
                 "block_px = 0");
  expect_refused(frame_samples(recording(), {std::nullopt, std::nullopt}, kAll, 2),
                 ErrorCode::kEmptySet, "none of 2 frames");
  expect_refused(frame_samples(recording(), poses(), {0, 0, 4, 10}, 2), ErrorCode::kEmptySet,
                 "no block of 2 x 2 pixels");
}

}  // namespace
}  // namespace brainshift::ultrasound
