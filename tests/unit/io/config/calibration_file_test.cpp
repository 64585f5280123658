// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/calibration_file.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using testing::HasSubstr;

StereoCalibration sample() {
  StereoCalibration c;
  c.width_px = 640;
  c.height_px = 480;
  c.left = {1100.0 / 3.0, 367.1, 322.5, 238.25, {-0.12, 0.08, 4e-4, -3e-17, 0.0}};
  c.right = {366.0, 367.0, 316.0, 243.0, {-0.11, 0.06, -5e-4, 2e-4, 0.01}};
  c.T_right_left.linear() =
      Eigen::AngleAxisd(0.12, Vec3(0.1, 1.0, -0.05).normalized()).toRotationMatrix();
  c.T_right_left.translation() = Vec3(-30.0 / 7.0, 0.1, 1e-3);
  c.rms_px = 0.31;
  c.epipolar_rms_px = 0.25;
  c.pairs = {{"left 01: \"a\\b\".jpg", 0.3}, {"left02.jpg", 0.325}};
  return c;
}

class CalibrationFile : public testing::Test {
 protected:
  std::string write(const std::string& text) {
    std::ofstream(folder_ / "c.yaml") << text;
    return (folder_ / "c.yaml").string();
  }
  // The sample with `from` replaced by `to`.
  std::string refusal(const std::string& from, const std::string& to) {
    std::string text = calibration_text(sample());
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    const auto read = read_calibration(write(text));
    return read ? "no refusal" : read.error().message;
  }
  test_support::TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path();
};

TEST_F(CalibrationFile, ComesBackBitForBit) {
  const StereoCalibration c = sample();
  const auto path = folder_ / "c.yaml";
  ASSERT_TRUE(write_calibration(path, c));
  const auto read = read_calibration(path);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->width_px, 640);
  EXPECT_EQ(read->left.focal_x_px, c.left.focal_x_px);
  EXPECT_EQ(read->left.distortion, c.left.distortion);
  EXPECT_EQ(read->right.centre_y_px, c.right.centre_y_px);
  EXPECT_TRUE(read->T_right_left.linear().isApprox(c.T_right_left.linear(), 1e-15));
  EXPECT_EQ(read->T_right_left.translation(), c.T_right_left.translation());
  EXPECT_EQ(read->rms_px, c.rms_px);
  ASSERT_EQ(read->pairs.size(), 2U);
  EXPECT_EQ(read->pairs[0].name, c.pairs[0].name);
  EXPECT_EQ(read->pairs[1].rms_px, c.pairs[1].rms_px);
}

TEST_F(CalibrationFile, BadOnesNameLineAndKey) {
  EXPECT_THAT(refusal("width_px: 640", "width_px: wide"),
              HasSubstr("c.yaml:3: image.width_px = wide: must be an integer"));
  EXPECT_THAT(refusal("height_px: 480", "height: 480"),
              HasSubstr("image.height_px: key is missing"));
  EXPECT_THAT(refusal("focal_y_px: 367.1", "focal_y_px: .nan"), HasSubstr("left.focal_y_px"));
  EXPECT_THAT(refusal("focal_x_px: 366\n", "focal_x_px: -366\n"),
              HasSubstr("right.focal_x_px = -366: must be finite and > 0"));
  EXPECT_THAT(refusal("-0.11, 0.06", "0.06"),
              HasSubstr("right.distortion: has 4 numbers: must have five"));
  EXPECT_THAT(refusal("rotation: [", "rotation: [1, "),
              HasSubstr("T_right_left.rotation: has 10 numbers: must have nine"));
  EXPECT_THAT(refusal("rotation: [0.9", "rotation: [1.9"),
              HasSubstr("T_right_left.rotation is no rigid motion"));
  EXPECT_THAT(refusal("translation_mm: [-", "translation_mm: ["),
              HasSubstr("left and right are swapped"));
  EXPECT_THAT(refusal("rms_px", "rmse_px"), HasSubstr("rmse_px: unknown key"));
}

TEST_F(CalibrationFile, EmptyAndAbsentFilesAreRefused) {
  EXPECT_THAT(read_calibration(write("")).error().message,
              HasSubstr("c.yaml: is not a YAML mapping"));
  const auto absent = read_calibration(folder_ / "absent.yaml");
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::io
