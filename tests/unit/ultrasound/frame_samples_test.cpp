// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/ultrasound/frame_samples.hpp"
#include "tests/support/results.hpp"

#include <gmock/gmock.h>

#include <string>

namespace brainshift::ultrasound {
namespace {

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
  const auto samples = value_or_fail(frame_samples(recording(), poses(), kAll, 2));
  // Columns 4 to 11 make 4 blocks; rows 0 to 9 make 5.
  ASSERT_EQ(samples.positions.cols(), 2 * 4 * 5);
  ASSERT_EQ(samples.intensities.size(), 2 * 4 * 5);
  EXPECT_TRUE(samples.positions.col(0).isApprox(Vec3(4.5 * 0.5, 0.5 * 0.25, 0.0)));
  EXPECT_DOUBLE_EQ(samples.intensities[0], 4.5 + 10 * 0.5);
  EXPECT_TRUE(samples.positions.col(20 + 19).isApprox(Vec3(10.5 * 0.5, 8.5 * 0.25, 3.0)));
  EXPECT_DOUBLE_EQ(samples.intensities[20 + 19], 10.5 + 10 * 8.5);
}

// Dark in one frame, but not in all: tissue.
TEST(FrameSamples, KeepDarkPixelsInsideTheSector) {
  const auto samples = value_or_fail(frame_samples(recording(), poses(), {6, 3, 1, 1}, 1));
  ASSERT_EQ(samples.intensities.size(), 2);
  EXPECT_EQ(samples.intensities[0], 0.0);
  EXPECT_EQ(samples.intensities[1], 36.0);
}

TEST(FrameSamples, StayInTheWindowAndLeaveOutFramesWithoutAPose) {
  ImagePoses one = poses();
  one[0].reset();
  const auto samples = value_or_fail(frame_samples(recording(), one, {5, 2, 100, 4}, 2));
  EXPECT_EQ(samples.intensities.size(), 3 * 2);
  EXPECT_TRUE((samples.positions.row(2).array() == 3.0).all());
  EXPECT_GE(samples.positions.row(0).minCoeff(), 0.5 * 5);
  tracking::Recording invalid = recording();
  invalid.image_ok[0] = 0;
  EXPECT_EQ(frame_samples(invalid, poses(), {5, 2, 100, 4}, 2)->intensities.size(), 3 * 2);
}

void expect_refused(const Result<IntensitySamples>& samples, ErrorCode code,
                    const std::string& text) {
  EXPECT_THAT(refusal_of(samples, code), HasSubstr(text));
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
