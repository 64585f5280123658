// SPDX-License-Identifier: GPL-3.0-or-later
// After rectification a point lies in the same row of both pictures, and its disparity gives its
// depth.
#include "common/stereo/rectify.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/support/stereo_scene.hpp"

namespace brainshift::stereo {
namespace {

using test_support::Eye;
using test_support::operating_rig;
using testing::HasSubstr;

// A picture with a soft white spot where the rig sees the point.
GrayImage spot(const StereoCalibration& rig, Eye eye, const Vec3& x) {
  const Eigen::Vector2d at = test_support::project(rig, eye, x);
  GrayImage image(rig.width_px, rig.height_px);
  for (int v = 0; v < image.height; ++v)
    for (int u = 0; u < image.width; ++u)
      image.at(u, v) = static_cast<std::uint8_t>(
          std::lround(250.0 * std::exp(-0.5 * (Eigen::Vector2d(u, v) - at).squaredNorm() / 6.0)));
  return image;
}

Eigen::Vector2d centroid(const GrayImage& image) {
  double sum = 0.0;
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      sum += image.at(u, v);
      at += image.at(u, v) * Eigen::Vector2d(u, v);
    }
  }
  return at / sum;
}

TEST(Rectify, APointLiesInOneRowAndItsDisparityGivesItBack) {
  const StereoCalibration rig = operating_rig();
  for (const Vec3& x : {Vec3(0, 0, 250), Vec3(-35, 20, 230), Vec3(40, -28, 280)}) {
    const auto rectified = rectify(spot(rig, Eye::kLeft, x), spot(rig, Eye::kRight, x), rig);
    ASSERT_TRUE(rectified) << rectified.error().message;
    const Eigen::Vector2d left = centroid(rectified->pair.left);
    const Eigen::Vector2d right = centroid(rectified->pair.right);
    EXPECT_NEAR(left.y(), right.y(), 0.1);  // of spots rounded to grey levels
    const Vec3 back = triangulate(rectified->geometry, left.x(), left.y(), left.x() - right.x());
    // 0.05 px of disparity are 0.1 mm of depth here.
    EXPECT_LT((back - x).norm(), 0.15) << back.transpose();
  }
}

TEST(Rectify, DepthAndDisparityAreInverse) {
  const RectifiedGeometry g{1000.0, 320.0, 300.0, 240.0, 30.0, Mat3::Identity()};
  EXPECT_DOUBLE_EQ(disparity_at(g, 250.0), 120.0 + 20.0);
  EXPECT_DOUBLE_EQ(depth_at(g, 140.0), 250.0);
  EXPECT_DOUBLE_EQ(depth_sd_mm(g, 140.0, 0.5), 250.0 * 250.0 / 30000.0 * 0.5);
  // Against the slope of the depth.
  EXPECT_NEAR(depth_sd_mm(g, 140.0, 1e-4), depth_at(g, 140.0) - depth_at(g, 140.0001), 1e-9);
  EXPECT_TRUE(triangulate(g, 320.0, 240.0, 140.0).isApprox(Vec3(0, 0, 250)));
  EXPECT_TRUE(triangulate(g, 420.0, 190.0, 140.0).isApprox(Vec3(25, -12.5, 250)));
}

TEST(Rectify, PicturesOfAnotherSizeThanTheCalibrationsAreRefused) {
  const GrayImage good(640, 480), small(320, 240);
  const auto left = rectify(small, good, operating_rig());
  ASSERT_FALSE(left);
  EXPECT_EQ(left.error().message,
            "the left picture has 320 x 240 px: the calibration is for 640 x 480 px");
  const auto right = rectify(good, small, operating_rig());
  ASSERT_FALSE(right);
  EXPECT_THAT(right.error().message, HasSubstr("the right picture has 320 x 240 px"));
}

struct BadCalibration {
  const char* name;
  void (*spoil)(StereoCalibration&);
  std::string says;
};
void PrintTo(const BadCalibration& bad, std::ostream* stream) { *stream << bad.name; }
class Calibration : public testing::TestWithParam<BadCalibration> {};

TEST_P(Calibration, ThatCannotBeIsRefused) {
  StereoCalibration rig = operating_rig();
  ASSERT_TRUE(validate(rig));
  GetParam().spoil(rig);
  const auto rectified = rectify(GrayImage(640, 480), GrayImage(640, 480), rig);
  ASSERT_FALSE(rectified);
  EXPECT_THAT(rectified.error().message, HasSubstr(GetParam().says));
}

INSTANTIATE_TEST_SUITE_P(
    Table, Calibration,
    testing::Values(
        BadCalibration{"Width", [](StereoCalibration& c) { c.width_px = 0; },
                       "image.width_px = 0: must be between 1 and 16384"},
        BadCalibration{"Height", [](StereoCalibration& c) { c.height_px = -1; },
                       "image.height_px = -1"},
        BadCalibration{"Focal", [](StereoCalibration& c) { c.left.focal_x_px = -3.0; },
                       "left.focal_x_px = -3: must be finite and > 0"},
        BadCalibration{"FocalNan", [](StereoCalibration& c) { c.right.focal_y_px = NAN; },
                       "right.focal_y_px = nan"},
        BadCalibration{"CentreX", [](StereoCalibration& c) { c.right.centre_x_px = 900.0; },
                       "right.centre_x_px = 900: must be inside the picture"},
        BadCalibration{"CentreY", [](StereoCalibration& c) { c.left.centre_y_px = -1.0; },
                       "left.centre_y_px = -1"},
        BadCalibration{"Distortion", [](StereoCalibration& c) { c.left.distortion[4] = 1e5; },
                       "left.distortion[4] = 100000"},
        BadCalibration{"Scaled", [](StereoCalibration& c) { c.T_right_left.linear() *= 1.1; },
                       "T_right_left is no rigid motion: R^T R differs from I by 0.2"},
        BadCalibration{"Mirrored",
                       [](StereoCalibration& c) { c.T_right_left.linear().col(0) *= -1.0; },
                       "reflection"},
        BadCalibration{"NotFinite",
                       [](StereoCalibration& c) { c.T_right_left.translation().x() = NAN; },
                       "T_right_left holds a value that is not a finite number"},
        BadCalibration{"NoBaseline",
                       [](StereoCalibration& c) { c.T_right_left.translation().setZero(); },
                       "baseline mm = 0"},
        BadCalibration{"Above",
                       [](StereoCalibration& c) {
                         c.T_right_left.translation() = c.T_right_left.linear() * Vec3(0, 30, 0);
                       },
                       "do not stand side by side"},
        BadCalibration{"Swapped",
                       [](StereoCalibration& c) { c.T_right_left = c.T_right_left.inverse(); },
                       "left and right are swapped"}),
    [](const auto& row) { return std::string(row.param.name); });

}  // namespace
}  // namespace brainshift::stereo
