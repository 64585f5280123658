// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/alignment_data.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace brainshift::registration {
namespace {

// What a homogeneous gradient about the centroid, and a shift, do to all points alike.
struct LinearField {
  Mat3 gradient = Mat3::Zero();
  Vec3 shift = Vec3::Zero();
};

Mat3 turning(const Vec3& w) {
  Mat3 matrix;
  matrix << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
  return matrix;
}

// Square root of the pose's covariance.
void add_pose(const IcpResult& icp, double rotation_sd_deg, std::vector<LinearField>& fields) {
  Mat6 covariance = icp.pose_covariance;
  if (rotation_sd_deg > 0.0) {
    const double rotation_sd = rotation_sd_deg * std::numbers::pi / 180.0;
    covariance.topLeftCorner<3, 3>() = rotation_sd * rotation_sd * Mat3::Identity();
    covariance.topRightCorner<3, 3>().setZero();
    covariance.bottomLeftCorner<3, 3>().setZero();
  }
  const SymmetricEigen<6> eigen = symmetric_eigen(covariance);
  for (int k = 0; k < 6; ++k) {
    const double sd = std::sqrt(std::max(0.0, eigen.values[k]));
    if (sd == 0.0) continue;
    const Vec6 axis = sd * eigen.vectors.col(k);
    fields.push_back({turning(axis.head<3>()), axis.tail<3>()});
  }
}

void add_strains(std::vector<LinearField>& fields) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    LinearField field;
    field.gradient(i, i) = kAlignmentStrainSd;
    fields.push_back(field);
    field.gradient.setZero();
    // isotropic: |gradient| equal
    field.gradient(i, j) = field.gradient(j, i) = kAlignmentStrainSd / std::numbers::sqrt2;
    fields.push_back(field);
  }
}

}  // namespace

SparseData sparse_data_from_alignment(const Points& points, const IcpResult& icp, double sd_mm,
                                      double rotation_sd_deg) {
  SparseData data;
  const RigidTransform& T = icp.T_surface_points;
  data.positions = (T.linear() * points).colwise() + Vec3(T.translation());
  data.displacements = points - data.positions;
  data.sd_mm = VecX::Constant(points.cols(), sd_mm);
  std::vector<LinearField> fields;
  add_pose(icp, rotation_sd_deg, fields);
  add_strains(fields);
  const Points arms = data.positions.colwise() - Vec3(data.positions.rowwise().mean());
  data.common_error.resize(data.positions.size(), static_cast<Eigen::Index>(fields.size()));
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const Points field = (fields[k].gradient * arms).colwise() + fields[k].shift;
    data.common_error.col(static_cast<Eigen::Index>(k)) =
        Eigen::Map<const VecX>(field.data(), field.size());
  }
  return data;
}

Eigen::MatrixXd pose_errors(const Points& places, double sd_mm, double sd_deg) {
  const bool shifts = sd_mm > 0.0, turns = sd_deg > 0.0;
  const Eigen::Index columns = (shifts ? 3 : 0) + (turns ? 3 : 0);
  if (columns == 0 || places.cols() == 0) return {};
  const Vec3 centre = places.rowwise().mean();
  const double turn_sd = sd_deg * std::numbers::pi / 180.0;
  Eigen::MatrixXd errors(3 * places.cols(), columns);
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 unit = Vec3::Unit(axis);
      if (shifts) errors.block<3, 1>(3 * i, axis) = sd_mm * unit;
      if (turns) {
        errors.block<3, 1>(3 * i, columns - 3 + axis) =
            turn_sd * unit.cross(places.col(i) - centre);
      }
    }
  }
  return errors;
}

}  // namespace brainshift::registration
