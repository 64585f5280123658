// SPDX-License-Identifier: Apache-2.0
#include "common/configuration/stereo_calibration.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "tests/support/results.hpp"

namespace brainshift {
namespace {

// The right camera 30 mm to the right of the left one: a point moves by -30 mm from left to
// right.
StereoCalibration rig() {
  StereoCalibration rig;
  rig.width_px = 640;
  rig.height_px = 480;
  rig.left = rig.right = {1100.0, 1100.0, 320.0, 240.0, {}};
  rig.T_right_left.translation() = Vec3(-30.0, 0.5, 0.0);
  return rig;
}

TEST(StereoCalibration, FindsTheRightCameraInTheLeftFrame) {
  StereoCalibration turned = rig();
  turned.T_right_left.linear() = Eigen::AngleAxisd(0.3, Vec3::UnitY()).toRotationMatrix();
  const Vec3 centre = right_camera_in_left(turned);
  EXPECT_LT((turned.T_right_left * centre).norm(), 1e-12);
  EXPECT_EQ(right_camera_in_left(rig()), Vec3(30.0, -0.5, 0.0));
}

TEST(StereoCalibration, AValidRigIsAccepted) {
  const Status status = validate(rig());
  EXPECT_TRUE(status.has_value()) << status.error().message;
}

TEST(StereoCalibration, InvalidRigsNameWhatIsWrong) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    const char* part;
    std::function<void(StereoCalibration&)> change;
  };
  const std::vector<Case> cases = {
      {"image.width_px = 0", [](auto& c) { c.width_px = 0; }},
      {"image.height_px = 20000", [](auto& c) { c.height_px = 20000; }},
      {"left.focal_x_px = -1", [](auto& c) { c.left.focal_x_px = -1.0; }},
      {"right.focal_y_px = nan", [nan](auto& c) { c.right.focal_y_px = nan; }},
      {"left.centre_x_px = 641", [](auto& c) { c.left.centre_x_px = 641.0; }},
      {"right.centre_y_px = -1", [](auto& c) { c.right.centre_y_px = -1.0; }},
      {"right.distortion[2] = 101", [](auto& c) { c.right.distortion[2] = 101.0; }},
      {"is no rigid motion", [](auto& c) { c.T_right_left.linear()(0, 0) = 1.01; }},
      {"T_right_left", [nan](auto& c) { c.T_right_left.translation()[1] = nan; }},
      {"baseline mm = 0", [](auto& c) { c.T_right_left.translation().setZero(); }},
      {"swapped", [](auto& c) { c.T_right_left.translation()[0] = 30.0; }},
      {"side by side", [](auto& c) { c.T_right_left.translation() = Vec3(-1.0, 30.0, 0.0); }},
  };
  for (const Case& each : cases) {
    StereoCalibration bad = rig();
    each.change(bad);
    EXPECT_THAT(sentence_of(validate(bad)), testing::HasSubstr(each.part));
  }
}

}  // namespace
}  // namespace brainshift
