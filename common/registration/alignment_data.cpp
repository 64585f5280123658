// SPDX-License-Identifier: GPL-3.0-or-later
// Sparse data from an alignment, with the errors that all its points share.
#include <numbers>
#include <vector>

#include "common/registration/icp.hpp"

namespace brainshift::registration {
namespace {

// Displacement of x from a homogeneous gradient about the centroid, one column per gradient.
Eigen::MatrixXd linear_fields(const Points& positions, const std::vector<Mat3>& gradients) {
  const Points arms = positions.colwise() - Vec3(positions.rowwise().mean());
  Eigen::MatrixXd fields(positions.size(), static_cast<Eigen::Index>(gradients.size()));
  for (std::size_t k = 0; k < gradients.size(); ++k) {
    const Points field = gradients[k] * arms;
    fields.col(static_cast<Eigen::Index>(k)) = Eigen::Map<const VecX>(field.data(), field.size());
  }
  return fields;
}

std::vector<Mat3> alignment_errors(double rotation_sd_deg) {
  std::vector<Mat3> gradients;
  const double rotation_sd = rotation_sd_deg * std::numbers::pi / 180.0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    Mat3 unit = Mat3::Zero();
    unit(i, i) = kAlignmentStrainSd;
    gradients.push_back(unit);
    unit.setZero();
    unit(i, j) = unit(j, i) = kAlignmentStrainSd / std::numbers::sqrt2;  // isotropic: |unit| equal
    gradients.push_back(unit);
    if (rotation_sd_deg <= 0.0) continue;
    unit.setZero();
    unit(i, j) = rotation_sd;
    unit(j, i) = -rotation_sd;
    gradients.push_back(unit);
  }
  return gradients;
}

}  // namespace

SparseData sparse_data_from_alignment(const Points& points, const RigidTransform& T_surface_points,
                                      double sd_mm, double rotation_sd_deg) {
  SparseData data;
  data.positions =
      (T_surface_points.linear() * points).colwise() + Vec3(T_surface_points.translation());
  data.displacements = points - data.positions;
  data.sd_mm = VecX::Constant(points.cols(), sd_mm);
  data.common_error = linear_fields(data.positions, alignment_errors(rotation_sd_deg));
  return data;
}

}  // namespace brainshift::registration
