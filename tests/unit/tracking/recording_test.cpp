// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/tracking/recording.hpp"

#include <gmock/gmock.h>

#include <limits>

namespace brainshift::tracking {
namespace {

TEST(Recording, ReadsPixelsOfEveryTypeRowByRow) {
  Recording recording;
  recording.width = 2, recording.height = 2;
  recording.time_s = {0.0, 1.0};
  recording.pixels = std::string("\x01\x02\x03\x04\x05\x06\x07\xFF", 8);
  Eigen::MatrixXf expected(2, 2);
  expected << 5, 6, 7, 255;
  EXPECT_EQ(recording.frame_values(1), expected);

  recording.pixel_type = PixelType::kInt16;
  const std::int16_t values[] = {1, 2, 3, 4, -5, 6, 7, -32768};
  recording.pixels.assign(reinterpret_cast<const char*>(values), sizeof values);
  expected << -5, 6, 7, -32768;
  EXPECT_EQ(recording.frame_values(1), expected);
  recording.pixel_type = PixelType::kUint16;
  expected << 65531, 6, 7, 32768;
  EXPECT_EQ(recording.frame_values(1), expected);
}

}  // namespace
}  // namespace brainshift::tracking
