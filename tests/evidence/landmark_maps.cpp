// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/landmark_maps.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <string>

#include "common/registration/fiducials.hpp"

namespace brainshift::evidence {
namespace {

// [x_i^T 1]
Eigen::MatrixXd affine_columns(const Points& places) {
  Eigen::MatrixXd columns(places.cols(), 4);
  columns << places.transpose(), VecX::Ones(places.cols());
  return columns;
}

Status check_pairs(const Points& before, const Points& during) {
  if (before.cols() != during.cols() || before.cols() < 4) {
    return fail(ErrorCode::kInvalidArgument, "landmarks: " + std::to_string(before.cols()) +
                                                 " before and " + std::to_string(during.cols()) +
                                                 " during surgery; at least 4 pairs are needed");
  }
  if (Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(affine_columns(before)).rank() < 4) {
    return fail(ErrorCode::kInvalidArgument, "landmarks: all lie in one plane");
  }
  return {};
}

}  // namespace

Result<PointMap> rigid_map(const Points& before, const Points& during) {
  const auto fit = registration::register_fiducials(before, during);
  if (!fit) return tl::unexpected(fit.error());
  const RigidTransform T = fit->T_image_measured;
  return [T](const Vec3& x) -> Vec3 { return T * x; };
}

Result<PointMap> affine_map(const Points& before, const Points& during) {
  if (Status ok = check_pairs(before, during); !ok) return tl::unexpected(ok.error());
  const Eigen::Matrix<double, 4, 3> map =
      affine_columns(before).colPivHouseholderQr().solve(during.transpose());
  return [map](const Vec3& x) -> Vec3 { return map.transpose() * x.homogeneous(); };
}

Result<PointMap> thin_plate_map(const Points& before, const Points& during) {
  if (Status ok = check_pairs(before, during); !ok) return tl::unexpected(ok.error());
  const Eigen::Index n = before.cols();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 4, n + 4);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      system(i, j) = (before.col(i) - before.col(j)).norm();
      if (i != j && system(i, j) == 0.0) {
        return fail(ErrorCode::kInvalidArgument, "landmarks: two lie at one place before surgery");
      }
    }
  }
  system.topRightCorner(n, 4) = affine_columns(before);
  system.bottomLeftCorner(4, n) = affine_columns(before).transpose();
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n + 4, 3);
  right.topRows(n) = during.transpose();
  const Eigen::MatrixXd weights = system.fullPivLu().solve(right);
  return [before, weights, n](const Vec3& x) -> Vec3 {
    VecX kernel(n + 4);
    kernel << (before.colwise() - x).colwise().norm().transpose(), x, 1.0;
    return weights.transpose() * kernel;
  };
}

}  // namespace brainshift::evidence
