// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/stereo/calibrate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "common/core/rigid_motion.hpp"
#include "common/stereo/cv_image.hpp"

namespace brainshift::stereo {
namespace {

using CvCorners = std::vector<cv::Point2f>;

std::vector<cv::Point3f> board_points(const ChessBoard& board) {
  std::vector<cv::Point3f> points;
  for (int j = 0; j < board.rows; ++j)
    for (int i = 0; i < board.columns; ++i)
      points.emplace_back(static_cast<float>(i * board.square_mm),
                          static_cast<float>(j * board.square_mm), 0.0F);
  return points;
}

CvCorners to_cv(const Eigen::Matrix2Xd& corners) {
  CvCorners points;
  for (Eigen::Index i = 0; i < corners.cols(); ++i)
    points.emplace_back(static_cast<float>(corners(0, i)), static_cast<float>(corners(1, i)));
  return points;
}

Eigen::Matrix2Xd from_cv(const CvCorners& points) {
  Eigen::Matrix2Xd corners(2, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    corners.col(static_cast<Eigen::Index>(i)) << points[i].x, points[i].y;
  return corners;
}

CameraIntrinsics intrinsics_of(const cv::Mat& K, const cv::Mat& distortion) {
  CameraIntrinsics camera;
  camera.focal_x_px = K.at<double>(0, 0);
  camera.focal_y_px = K.at<double>(1, 1);
  camera.centre_x_px = K.at<double>(0, 2);
  camera.centre_y_px = K.at<double>(1, 2);
  const cv::Mat row = distortion.reshape(1, 1);
  for (int i = 0; i < std::min(5, row.cols); ++i)
    camera.distortion[static_cast<std::size_t>(i)] = row.at<double>(0, i);
  return camera;
}

// What OpenCV takes and gives.
struct Views {
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<CvCorners> left, right;
};

struct Fit {
  cv::Mat K_left, D_left, K_right, D_right, R, T, F, per_view;
  double rms_px = 0.0;
};

Fit minimise(const Views& views, const cv::Size& size) {
  Fit fit;
  std::vector<cv::Mat> rotations, translations;
  const cv::TermCriteria stop(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-8);
  cv::calibrateCamera(views.board, views.left, size, fit.K_left, fit.D_left, rotations,
                      translations, cv::CALIB_FIX_K3, stop);
  cv::calibrateCamera(views.board, views.right, size, fit.K_right, fit.D_right, rotations,
                      translations, cv::CALIB_FIX_K3, stop);
  cv::Mat E;
  fit.rms_px = cv::stereoCalibrate(
      views.board, views.left, views.right, fit.K_left, fit.D_left, fit.K_right, fit.D_right, size,
      fit.R, fit.T, E, fit.F, fit.per_view, cv::CALIB_USE_INTRINSIC_GUESS | cv::CALIB_FIX_K3, stop);
  return fit;
}

// Undistorted, in pixels.
Eigen::Matrix2Xd undistorted(const Eigen::Matrix2Xd& corners, const CameraIntrinsics& camera) {
  CvCorners points;
  cv::undistortPoints(to_cv(corners), points, camera_matrix(camera), distortion_of(camera),
                      cv::noArray(), camera_matrix(camera));
  return from_cv(points);
}

// Sum of squared distances of points from lines a x + b y + c = 0.
double squared_distances(const Eigen::Matrix2Xd& points, const Eigen::Matrix3Xd& lines) {
  const Eigen::ArrayXd along =
      (points.colwise().homogeneous().array() * lines.array()).colwise().sum();
  return (along.square() / lines.topRows<2>().colwise().squaredNorm().transpose().array()).sum();
}

StereoCalibration calibration_of(const std::vector<BoardCorners>& corners, const Fit& fit,
                                 const cv::Size& size) {
  StereoCalibration calibration;
  calibration.width_px = size.width;
  calibration.height_px = size.height;
  calibration.left = intrinsics_of(fit.K_left, fit.D_left);
  calibration.right = intrinsics_of(fit.K_right, fit.D_right);
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) T(i, j) = fit.R.at<double>(i, j);
    T(i, 3) = fit.T.at<double>(i);
  }
  calibration.T_right_left = nearest_rigid(T);
  calibration.rms_px = fit.rms_px;
  calibration.epipolar_rms_px = epipolar_rms(calibration, corners);
  for (std::size_t v = 0; v < corners.size(); ++v) {
    const auto row = static_cast<int>(v);
    const double left = fit.per_view.at<double>(row, 0), right = fit.per_view.at<double>(row, 1);
    calibration.pairs.push_back({corners[v].name, std::sqrt(0.5 * (left * left + right * right))});
  }
  return calibration;
}

Status check_corners(const std::vector<BoardCorners>& corners, const ChessBoard& board) {
  if (static_cast<int>(corners.size()) < kFewestPairs) {
    return invalid(fmt::format("a {} x {} board was found in {} pairs: at least {} are needed",
                               board.columns, board.rows, corners.size(), kFewestPairs));
  }
  const int expected = board.columns * board.rows;
  for (const BoardCorners& pair : corners) {
    if (pair.left.cols() == expected && pair.right.cols() == expected) continue;
    return invalid(fmt::format("{}: {} and {} corners: the board has {}", pair.name,
                               pair.left.cols(), pair.right.cols(), expected));
  }
  return {};
}

}  // namespace

Status validate(const ChessBoard& board) {
  if (board.columns < 3 || board.rows < 3 || board.columns > 100 || board.rows > 100) {
    return invalid(fmt::format("board = {}x{}: must have 3 to 100 inner corners along each side",
                               board.columns, board.rows));
  }
  if (!(std::isfinite(board.square_mm) && board.square_mm > 0.0)) {
    return invalid(fmt::format("square_mm = {}: must be finite and > 0", board.square_mm));
  }
  return {};
}

double epipolar_rms(const StereoCalibration& calibration,
                    const std::vector<BoardCorners>& corners) {
  const auto K = [](const CameraIntrinsics& c) {
    return (Mat3() << c.focal_x_px, 0, c.centre_x_px, 0, c.focal_y_px, c.centre_y_px, 0, 0, 1)
        .finished();
  };
  const Vec3 t = calibration.T_right_left.translation();
  const Mat3 cross = (Mat3() << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0).finished();
  // x_right^T F x_left = 0
  const Mat3 F = K(calibration.right).inverse().transpose() * cross *
                 calibration.T_right_left.linear() * K(calibration.left).inverse();
  double sum = 0.0, count = 0.0;
  for (const BoardCorners& pair : corners) {
    const Eigen::Matrix2Xd left = undistorted(pair.left, calibration.left);
    const Eigen::Matrix2Xd right = undistorted(pair.right, calibration.right);
    sum += squared_distances(right, F * left.colwise().homogeneous());
    sum += squared_distances(left, F.transpose() * right.colwise().homogeneous());
    count += 2.0 * static_cast<double>(left.cols());
  }
  return std::sqrt(sum / count);
}

Eigen::Matrix2Xd find_corners(const GrayImage& picture, const ChessBoard& board) {
  if (picture.empty()) return {};
  const cv::Mat view = view_of(picture);
  CvCorners found;
  if (!cv::findChessboardCorners(view, {board.columns, board.rows}, found,
                                 cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE)) {
    return {};
  }
  // The window must not reach the next corner.
  double nearest = 1e9;
  for (std::size_t i = 1; i < found.size(); ++i)
    nearest = std::min(nearest, cv::norm(found[i] - found[i - 1]));
  const int half = std::clamp(static_cast<int>(nearest / 2.0) - 1, 2, 11);
  cv::cornerSubPix(view, found, {half, half}, {-1, -1},
                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-3});
  return from_cv(found);
}

Result<StereoCalibration> calibrate(const std::vector<BoardCorners>& corners,
                                    const ChessBoard& board, int width_px, int height_px) {
  if (Status ok = validate(board); !ok) return tl::unexpected(ok.error());
  if (Status ok = check_corners(corners, board); !ok) return tl::unexpected(ok.error());
  const cv::Size size(width_px, height_px);
  Views views;
  for (const BoardCorners& pair : corners) {
    views.board.push_back(board_points(board));
    views.left.push_back(to_cv(pair.left));
    views.right.push_back(to_cv(pair.right));
  }
  StereoCalibration calibration;
  try {
    calibration = calibration_of(corners, minimise(views, size), size);
  } catch (const cv::Exception& problem) {
    return fail(ErrorCode::kNotConverged, "the calibration cannot be computed: " + problem.err);
  }
  if (!(calibration.rms_px <= kMaxRms_px)) {
    return fail(ErrorCode::kNotConverged,
                fmt::format("reprojection error {:.2f} px: must be at most {} px; are all pairs of "
                            "one board, one rig and taken at once?",
                            calibration.rms_px, kMaxRms_px));
  }
  if (Status ok = validate(calibration); !ok) return tl::unexpected(ok.error());
  return calibration;
}

Result<CalibrationResult> calibrate(const std::vector<PicturePair>& pairs,
                                    const ChessBoard& board) {
  if (Status ok = validate(board); !ok) return tl::unexpected(ok.error());
  CalibrationResult result;
  std::vector<BoardCorners> corners;
  for (const PicturePair& pair : pairs) {
    const GrayImage& first = pairs.front().left;
    for (const GrayImage* picture : {&pair.left, &pair.right}) {
      if (picture->width == first.width && picture->height == first.height) continue;
      return invalid(fmt::format("{}: a picture of {} x {} px: the first one has {} x {} px",
                                 pair.name, picture->width, picture->height, first.width,
                                 first.height));
    }
    BoardCorners found{pair.name, find_corners(pair.left, board), find_corners(pair.right, board)};
    if (found.left.cols() == 0 || found.right.cols() == 0) {
      result.without_board.push_back(pair.name);
    } else {
      corners.push_back(std::move(found));
    }
  }
  const int width = pairs.empty() ? 0 : pairs.front().left.width;
  const int height = pairs.empty() ? 0 : pairs.front().left.height;
  auto calibration = calibrate(corners, board, width, height);
  if (!calibration) return tl::unexpected(calibration.error());
  result.calibration = std::move(*calibration);
  return result;
}

}  // namespace brainshift::stereo
