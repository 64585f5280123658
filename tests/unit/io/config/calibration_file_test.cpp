// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/calibration_file.hpp"

#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

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
  Result<StereoCalibration> read(const std::string& text) {
    return read_calibration(folder_.write("c.yaml", text));
  }
  test_support::TemporaryFolder folder_;
};

TEST_F(CalibrationFile, ComesBackBitForBit) {
  const StereoCalibration c = sample();
  const auto path = folder_ / "c.yaml";
  ASSERT_TRUE(write_calibration(path, c));
  const auto read = value_or_fail(read_calibration(path));
  EXPECT_EQ(read.width_px, 640);
  EXPECT_EQ(read.left.focal_x_px, c.left.focal_x_px);
  EXPECT_EQ(read.left.distortion, c.left.distortion);
  EXPECT_EQ(read.right.centre_y_px, c.right.centre_y_px);
  EXPECT_TRUE(read.T_right_left.linear().isApprox(c.T_right_left.linear(), 1e-15));
  EXPECT_EQ(read.T_right_left.translation(), c.T_right_left.translation());
  EXPECT_EQ(read.rms_px, c.rms_px);
  ASSERT_EQ(read.pairs.size(), 2U);
  EXPECT_EQ(read.pairs[0].name, c.pairs[0].name);
  EXPECT_EQ(read.pairs[1].rms_px, c.pairs[1].rms_px);
}

TEST_F(CalibrationFile, BadOnesNameLineAndKey) {
  const auto read = [this](const std::string& text) { return this->read(text); };
  test_support::expect_edits_refused(
      read, calibration_text(sample()),
      {{"width_px: 640", "width_px: wide", "c.yaml:3: image.width_px = wide: must be an integer"},
       {"height_px: 480", "height: 480", "image.height_px: key is missing"},
       {"focal_y_px: 367.1", "focal_y_px: .nan", "left.focal_y_px"},
       {"focal_x_px: 366\n", "focal_x_px: -366\n",
        "right.focal_x_px = -366: must be finite and > 0"},
       {"-0.11, 0.06", "0.06", "right.distortion: has 4 numbers: must have five"},
       {"rotation: [", "rotation: [1, ", "T_right_left.rotation: has 10 numbers: must have nine"},
       {"rotation: [0.9", "rotation: [1.9", "T_right_left.rotation is no rigid motion"},
       {"translation_mm: [-", "translation_mm: [", "left and right are swapped"},
       {"rms_px", "rmse_px", "rmse_px: unknown key"}},
      ErrorCode::kInvalidArgument);
  test_support::expect_refused(read, {{"", "c.yaml: is not a YAML mapping"}},
                               ErrorCode::kInvalidArgument);
  refusal_of(read_calibration(folder_ / "absent.yaml"), ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::io
