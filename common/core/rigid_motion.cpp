// SPDX-License-Identifier: Apache-2.0
#include "common/core/rigid_motion.hpp"

#include <Eigen/LU>
#include <sstream>
#include <string>

#include "common/core/small_matrices.hpp"

namespace brainshift {
namespace {

constexpr double kLargestCondition = 1e4;

Status check_finite(const Eigen::Matrix4d& matrix) {
  if (!matrix.allFinite()) {
    return fail(ErrorCode::kNotFinite, "holds a value that is not a finite number");
  }
  if (!matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), 1e-9)) {
    return invalid("its last row is not 0 0 0 1");
  }
  return {};
}

std::string digits(double value) {
  std::ostringstream text;
  text.precision(3);
  text << value;
  return text.str();
}

}  // namespace

Status check_rigid(const Eigen::Matrix4d& matrix, double tolerance) {
  if (Status finite = check_finite(matrix); !finite) return finite;
  const Mat3 R = matrix.topLeftCorner<3, 3>();
  const double error = (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff();
  if (error > tolerance) {
    return invalid("is no rigid motion: R^T R differs from I by " + digits(error));
  }
  if (R.determinant() < 0.0) return invalid("is no rigid motion: it is a reflection");
  return {};
}

Status check_affine(const Eigen::Matrix4d& matrix) {
  if (Status finite = check_finite(matrix); !finite) return finite;
  const Mat3 linear = matrix.topLeftCorner<3, 3>();
  const Vec3 stretch = singular_values(linear).values;
  if (!(stretch[2] > 0.0) || stretch[0] > kLargestCondition * stretch[2]) {
    return invalid("cannot be inverted: it stretches by " + digits(stretch[0]) + " and by " +
                   digits(stretch[2]));
  }
  return {};
}

RigidTransform nearest_rigid(const Eigen::Matrix4d& matrix) {
  const SingularValues svd = singular_values(matrix.topLeftCorner<3, 3>());
  RigidTransform T = RigidTransform::Identity();
  T.linear() = svd.U * svd.V.transpose();
  T.translation() = matrix.topRightCorner<3, 1>();
  return T;
}

}  // namespace brainshift
