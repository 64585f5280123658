// SPDX-License-Identifier: GPL-3.0-or-later
// The calibration is recovered from boards drawn by known cameras.
#include "common/stereo/calibrate.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "common/core/random.hpp"
#include "tests/support/results.hpp"
#include "tests/support/stereo_scene.hpp"

namespace brainshift::stereo {
namespace {

using test_support::board_pose;
using test_support::exact_corners;
using test_support::Eye;
using test_support::operating_rig;
using testing::HasSubstr;

const ChessBoard kBoard{9, 6, 8.0};

std::vector<BoardCorners> exact_pairs(int count, double noise_px = 0.0) {
  Random random(5);
  std::vector<BoardCorners> pairs;
  for (int i = 0; i < count; ++i) {
    pairs.push_back(exact_corners(operating_rig(), kBoard, board_pose(i, kBoard)));
    pairs.back().name = std::string("pair").append(std::to_string(i));
    for (Eigen::Matrix2Xd* corners : {&pairs.back().left, &pairs.back().right})
      for (double& x : corners->reshaped()) x += noise_px * random.normal();
  }
  return pairs;
}

double angle_deg(const RigidTransform& a, const RigidTransform& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle() * 180.0 / 3.14159265;
}

std::string refusal(const Result<StereoCalibration>& result) {
  return result ? "no refusal" : result.error().message;
}

TEST(Calibrate, ExactCornersGiveTheRigBack) {
  const StereoCalibration rig = operating_rig();
  const auto found = value_or_fail(calibrate(exact_pairs(10), kBoard, 640, 480));
  // Corners are rounded to 32 bits on the way: about 3e-5 px.
  EXPECT_LT(found.rms_px, 1e-3);
  EXPECT_LT(found.epipolar_rms_px, 1e-3);
  EXPECT_NEAR(found.left.focal_x_px, rig.left.focal_x_px, 0.1);
  EXPECT_NEAR(found.right.focal_y_px, rig.right.focal_y_px, 0.1);
  EXPECT_NEAR(found.left.centre_x_px, rig.left.centre_x_px, 0.1);
  EXPECT_NEAR(found.right.centre_y_px, rig.right.centre_y_px, 0.1);
  EXPECT_NEAR(found.left.distortion[0], rig.left.distortion[0], 0.002);
  EXPECT_NEAR(found.right.distortion[2], rig.right.distortion[2], 1e-5);
  EXPECT_LT((found.T_right_left.translation() - rig.T_right_left.translation()).norm(), 0.01);
  EXPECT_LT(angle_deg(found.T_right_left, rig.T_right_left), 0.01);
  EXPECT_EQ(found.pairs.size(), 10U);
}

TEST(Calibrate, TheReprojectionErrorIsTheNoiseOfTheCorners) {
  const auto found = value_or_fail(calibrate(exact_pairs(12, 0.2), kBoard, 640, 480));
  // rms over corners of two components of 0.2 px each, less a little for what the fit takes up.
  EXPECT_NEAR(found.rms_px, 0.2 * std::sqrt(2.0), 0.03);
  EXPECT_NEAR(found.epipolar_rms_px, 0.2 * std::sqrt(2.0), 0.05);
  for (const CalibrationPair& pair : found.pairs) EXPECT_NEAR(pair.rms_px, 0.28, 0.1) << pair.name;
  EXPECT_NEAR(right_camera_in_left(found).norm(), right_camera_in_left(operating_rig()).norm(),
              0.3);
}

TEST(Calibrate, PicturesOfABoardGiveTheRigBackAndPairsWithoutItAreListed) {
  const StereoCalibration rig = operating_rig();
  std::vector<PicturePair> pairs;
  for (int i = 0; i < 7; ++i) {
    const RigidTransform T = board_pose(i, kBoard);
    pairs.push_back({std::string("p").append(std::to_string(i)), render(rig, Eye::kLeft, kBoard, T),
                     render(rig, Eye::kRight, kBoard, T)});
  }
  pairs[3].right = GrayImage(640, 480, 128);
  const auto found = value_or_fail(calibrate(pairs, kBoard));
  EXPECT_THAT(found.without_board, testing::ElementsAre("p3"));
  EXPECT_EQ(found.calibration.pairs.size(), 6U);
  EXPECT_LT(found.calibration.rms_px, 0.15);
  EXPECT_NEAR(found.calibration.left.focal_x_px, rig.left.focal_x_px, 6.0);
  EXPECT_NEAR(right_camera_in_left(found.calibration).norm(), right_camera_in_left(rig).norm(),
              0.15);
  EXPECT_LT(angle_deg(found.calibration.T_right_left, rig.T_right_left), 0.3);
}

TEST(Calibrate, TooFewPairsAreRefused) {
  EXPECT_EQ(refusal(calibrate(exact_pairs(4), kBoard, 640, 480)),
            "a 9 x 6 board was found in 4 pairs: at least 5 are needed");
}

TEST(Calibrate, SwappedCamerasAreRefused) {
  auto pairs = exact_pairs(8);
  for (BoardCorners& pair : pairs) std::swap(pair.left, pair.right);
  EXPECT_THAT(refusal(calibrate(pairs, kBoard, 640, 480)),
              HasSubstr("left and right are swapped: the right camera stands 29."));
}

TEST(Calibrate, PairsOfDifferentMomentsAreRefused) {
  auto pairs = exact_pairs(8);
  for (std::size_t i = 0; i + 1 < pairs.size(); ++i) std::swap(pairs[i].right, pairs[i + 1].right);
  EXPECT_THAT(refusal(calibrate(pairs, kBoard, 640, 480)), HasSubstr("reprojection error"));
}

TEST(Calibrate, ABoardOfAnotherSizeIsNamed) {
  auto pairs = exact_pairs(6);
  pairs[2].right.conservativeResize(2, 50);
  EXPECT_EQ(refusal(calibrate(pairs, kBoard, 640, 480)),
            "pair2: 54 and 50 corners: the board has 54");
  EXPECT_EQ(refusal(calibrate(pairs, {2, 6, 8.0}, 640, 480)),
            "board = 2x6: must have 3 to 100 inner corners along each side");
  EXPECT_EQ(refusal(calibrate(pairs, {9, 6, 0.0}, 640, 480)),
            "square_mm = 0: must be finite and > 0");
}

TEST(Calibrate, PicturesOfDifferentSizesAreNamed) {
  std::vector<PicturePair> pairs(5, {"a", GrayImage(64, 48), GrayImage(64, 48)});
  pairs[1] = {"b", GrayImage(64, 48), GrayImage(32, 48)};
  EXPECT_EQ(sentence_of(calibrate(pairs, kBoard)),
            "b: a picture of 32 x 48 px: the first one has 64 x 48 px");
}

}  // namespace
}  // namespace brainshift::stereo
