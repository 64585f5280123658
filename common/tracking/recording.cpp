// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/tracking/recording.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cstdint>
#include <cstring>

namespace brainshift::tracking {
namespace {

constexpr double kLargestCondition = 1e4;

Status check_finite(const Eigen::Matrix4d& matrix) {
  if (!matrix.allFinite()) {
    return fail(ErrorCode::kNotFinite, "holds a value that is not a finite number");
  }
  if (!matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), 1e-9)) {
    return fail(ErrorCode::kInvalidArgument, "its last row is not 0 0 0 1");
  }
  return {};
}

template <typename T>
void copy_values(std::string_view bytes, Eigen::MatrixXf& values) {
  const char* from = bytes.data();
  for (Eigen::Index v = 0; v < values.rows(); ++v) {
    for (Eigen::Index u = 0; u < values.cols(); ++u, from += sizeof(T)) {
      T value{};
      std::memcpy(&value, from, sizeof(T));
      values(v, u) = static_cast<float>(value);
    }
  }
}

}  // namespace

int bytes_per_pixel(PixelType type) { return type == PixelType::kUint8 ? 1 : 2; }

std::string_view Recording::frame_bytes(int frame) const {
  const std::size_t size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                           static_cast<std::size_t>(bytes_per_pixel(pixel_type));
  return std::string_view(pixels).substr(static_cast<std::size_t>(frame) * size, size);
}

Eigen::MatrixXf Recording::frame_values(int frame) const {
  Eigen::MatrixXf values(height, width);
  const std::string_view bytes = frame_bytes(frame);
  switch (pixel_type) {
    case PixelType::kUint8: copy_values<std::uint8_t>(bytes, values); break;
    case PixelType::kInt16: copy_values<std::int16_t>(bytes, values); break;
    case PixelType::kUint16: copy_values<std::uint16_t>(bytes, values); break;
  }
  return values;
}

Status check_rigid(const Eigen::Matrix4d& matrix, double tolerance) {
  if (Status finite = check_finite(matrix); !finite) return finite;
  const Mat3 R = matrix.topLeftCorner<3, 3>();
  const double error = (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff();
  if (error > tolerance) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("is no rigid motion: R^T R differs from I by {:.3g}", error));
  }
  if (R.determinant() < 0.0) {
    return fail(ErrorCode::kInvalidArgument, "is no rigid motion: it is a reflection");
  }
  return {};
}

Status check_affine(const Eigen::Matrix4d& matrix) {
  if (Status finite = check_finite(matrix); !finite) return finite;
  const Mat3 linear = matrix.topLeftCorner<3, 3>();
  const Vec3 stretch = Eigen::JacobiSVD<Mat3>(linear).singularValues();
  if (!(stretch[2] > 0.0) || stretch[0] > kLargestCondition * stretch[2]) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("cannot be inverted: it stretches by {:.3g} and by {:.3g}", stretch[0],
                            stretch[2]));
  }
  return {};
}

RigidTransform nearest_rigid(const Eigen::Matrix4d& matrix) {
  const Mat3 linear = matrix.topLeftCorner<3, 3>();
  const Eigen::JacobiSVD<Mat3> svd(linear, Eigen::ComputeFullU | Eigen::ComputeFullV);
  RigidTransform T = RigidTransform::Identity();
  T.linear() = svd.matrixU() * svd.matrixV().transpose();
  T.translation() = matrix.topRightCorner<3, 1>();
  return T;
}

}  // namespace brainshift::tracking
