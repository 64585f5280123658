// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures and cameras as OpenCV sees them. Private to common/stereo: it includes OpenCV.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "common/configuration/stereo_calibration.hpp"
#include "common/stereo/gray_image.hpp"

namespace brainshift::stereo {

// A view without a copy, valid as long as the picture. Callers must not write through it.
inline cv::Mat view_of(const GrayImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels.data())};
}

inline GrayImage gray_from(const cv::Mat& picture) {
  GrayImage image(picture.cols, picture.rows);
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) image.at(x, y) = picture.at<std::uint8_t>(y, x);
  return image;
}

inline cv::Matx33d camera_matrix(const CameraIntrinsics& camera) {
  return {
      camera.focal_x_px, 0, camera.centre_x_px, 0, camera.focal_y_px, camera.centre_y_px, 0, 0, 1};
}

inline std::vector<double> distortion_of(const CameraIntrinsics& camera) {
  return {camera.distortion.begin(), camera.distortion.end()};
}

inline cv::Matx33d rotation_of(const RigidTransform& T) {
  cv::Matx33d R;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) R(i, j) = T.linear()(i, j);
  return R;
}

inline cv::Vec3d translation_of(const RigidTransform& T) {
  return {T.translation().x(), T.translation().y(), T.translation().z()};
}

}  // namespace brainshift::stereo
