// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/stereo/rectify.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "common/stereo/cv_image.hpp"

namespace brainshift::stereo {
namespace {

Status check_size(const char* side, const GrayImage& picture,
                  const StereoCalibration& calibration) {
  if (picture.width == calibration.width_px && picture.height == calibration.height_px) return {};
  return fail(
      ErrorCode::kInvalidArgument,
      fmt::format("the {} picture has {} x {} px: the calibration is for {} x {} px", side,
                  picture.width, picture.height, calibration.width_px, calibration.height_px));
}

// One picture as its rectified camera sees it, and where that lies inside the original.
void resample(const GrayImage& picture, const CameraIntrinsics& camera, const cv::Matx33d& R,
              const cv::Mat& P, GrayImage& out, GrayImage& seen) {
  cv::Mat map_x, map_y, moved;
  cv::initUndistortRectifyMap(camera_matrix(camera), distortion_of(camera), R, P,
                              {picture.width, picture.height}, CV_32FC1, map_x, map_y);
  cv::remap(view_of(picture), moved, map_x, map_y, cv::INTER_CUBIC, cv::BORDER_CONSTANT);
  out = gray_from(moved);
  seen = GrayImage(picture.width, picture.height);
  for (int y = 0; y < seen.height; ++y) {
    for (int x = 0; x < seen.width; ++x) {
      const float u = map_x.at<float>(y, x), v = map_y.at<float>(y, x);
      seen.at(x, y) = u >= 0.0F && v >= 0.0F && u <= static_cast<float>(picture.width - 1) &&
                      v <= static_cast<float>(picture.height - 1);
    }
  }
}

}  // namespace

double disparity_at(const RectifiedGeometry& g, double depth_mm) {
  assert(depth_mm > 0.0);
  return g.focal_px * g.baseline_mm / depth_mm + g.centre_left_px - g.centre_right_px;
}

double depth_at(const RectifiedGeometry& g, double disparity_px) {
  return g.focal_px * g.baseline_mm / (disparity_px - g.centre_left_px + g.centre_right_px);
}

Vec3 triangulate(const RectifiedGeometry& g, double x_px, double y_px, double disparity_px) {
  const double z = depth_at(g, disparity_px);
  return g.R_left_rectified * Vec3((x_px - g.centre_left_px) * z / g.focal_px,
                                   (y_px - g.centre_row_px) * z / g.focal_px, z);
}

double depth_sd_mm(const RectifiedGeometry& g, double disparity_px, double disparity_sd_px) {
  const double z = depth_at(g, disparity_px);
  return z * z / (g.focal_px * g.baseline_mm) * disparity_sd_px;
}

Result<Rectified> rectify(const GrayImage& left, const GrayImage& right,
                          const StereoCalibration& calibration) {
  if (Status ok = validate(calibration); !ok) return tl::unexpected(ok.error());
  if (Status ok = check_size("left", left, calibration); !ok) return tl::unexpected(ok.error());
  if (Status ok = check_size("right", right, calibration); !ok) return tl::unexpected(ok.error());
  cv::Matx33d R1, R2;
  cv::Mat P1, P2, Q;
  cv::stereoRectify(camera_matrix(calibration.left), distortion_of(calibration.left),
                    camera_matrix(calibration.right), distortion_of(calibration.right),
                    {left.width, left.height}, rotation_of(calibration.T_right_left),
                    translation_of(calibration.T_right_left), R1, R2, P1, P2, Q, 0);
  Rectified rectified;
  RectifiedGeometry& g = rectified.geometry;
  g.focal_px = P1.at<double>(0, 0);
  g.centre_left_px = P1.at<double>(0, 2);
  g.centre_right_px = P2.at<double>(0, 2);
  g.centre_row_px = P1.at<double>(1, 2);
  g.baseline_mm = -P2.at<double>(0, 3) / P2.at<double>(0, 0);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) g.R_left_rectified(i, j) = R1(j, i);
  // OpenCV takes the larger component of the baseline. A valid calibration may still be too near
  // the diagonal.
  if (!(g.baseline_mm > 0.0) || P2.at<double>(1, 3) != 0.0) {
    return fail(ErrorCode::kInvalidArgument,
                "T_right_left: the cameras do not stand side by side enough to be rectified");
  }
  resample(left, calibration.left, R1, P1, rectified.pair.left, rectified.pair.left_seen);
  resample(right, calibration.right, R2, P2, rectified.pair.right, rectified.pair.right_seen);
  return rectified;
}

}  // namespace brainshift::stereo
