// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/pose_information.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace brainshift::registration {

RigidTransform rigid_increment(const Vec6& xi, const Vec3& centre) {
  const Vec3 w = xi.head<3>();
  const double angle = w.norm();
  RigidTransform increment = RigidTransform::Identity();
  if (angle > 0.0) increment.linear() = Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
  increment.translation() = centre - increment.linear() * centre + xi.tail<3>();
  return increment;
}

Vec3 rotation_vector(const Mat3& rotation) {
  const Eigen::AngleAxisd angle_axis(rotation);
  return angle_axis.angle() * angle_axis.axis();
}

Vec6 direction_gradient(const Vec3& x, const Vec3& n, const Vec3& centre) {
  Vec6 gradient;
  gradient << (x - centre).cross(n), n;
  return gradient;
}

namespace {

// An axis and its opposite are one; without a sign of zero.
Vec3 presentable(Vec3 axis) {
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  if (axis[largest] < 0.0) axis = -axis;
  for (double& value : axis) value = std::abs(value) < 0.005 ? 0.0 : value;
  return axis;
}

void add_sentences(const char* motion, const char* preposition, const Vec3& ratios,
                   const Mat3& axes, double threshold, std::vector<std::string>& sentences) {
  if ((ratios.array() < threshold).all()) {
    sentences.push_back(fmt::format("no {} is shown by the points", motion));
    return;
  }
  for (int k = 0; k < 3; ++k) {
    if (ratios[k] >= threshold) continue;
    const Vec3 axis = presentable(axes.col(k));
    sentences.push_back(fmt::format("{} {} ({:.2f}, {:.2f}, {:.2f}) is not shown by the points",
                                    motion, preposition, axis.x(), axis.y(), axis.z()));
  }
}

}  // namespace

std::vector<std::string> not_shown(const Observability& seen) {
  std::vector<std::string> sentences;
  add_sentences("rotation", "about", seen.rotation_ratios, seen.rotation_axes, seen.threshold,
                sentences);
  add_sentences("translation", "along", seen.translation_ratios, seen.translation_axes,
                seen.threshold, sentences);
  return sentences;
}

namespace {

// Points are summed four at a time, lane by lane.
constexpr Eigen::Index kLanes = 4;
using Lanes = Eigen::Array<double, kLanes, 1>;

// The lower triangle of J^T W J, row by row, then J^T W r.
constexpr std::size_t kTriangle = 21;
struct Sums {
  std::array<Lanes, kTriangle + 6> lanes;

  Sums() { lanes.fill(Lanes::Zero()); }
  void add(const std::array<Lanes, 6>& row, const Lanes& residual, const Lanes& weight) {
    std::size_t at = 0;
    for (std::size_t a = 0; a < 6; ++a) {
      const Lanes weighted = weight * row[a];
      for (std::size_t b = 0; b <= a; ++b) lanes[at++] += weighted * row[b];
      lanes[kTriangle + a] += weighted * residual;
    }
  }
};

// Up to four numbers from `first`, the rest zero.
template <typename Column>
Lanes some(const Column& column, Eigen::Index first, Eigen::Index count) {
  if (count == kLanes) return column.template segment<kLanes>(first).array();
  Lanes lanes = Lanes::Zero();
  for (Eigen::Index k = 0; k < count; ++k) lanes[k] = column[first + k];
  return lanes;
}

}  // namespace

PoseInformation pose_information(const geometry::PointRows& points,
                                 const geometry::PointRows& gradients, const VecX& residuals,
                                 const VecX& weights, double sd_mm, const Vec3& centre,
                                 double radius_mm) {
  PoseInformation information;
  information.centre = centre;
  information.radius_mm = radius_mm;
  const double per_radius = 1.0 / radius_mm;
  Sums sums;
  for (Eigen::Index i = 0; i < points.rows(); i += kLanes) {
    const Eigen::Index count = std::min(kLanes, points.rows() - i);
    const Lanes x = per_radius * (some(points.col(0), i, count) - centre.x());
    const Lanes y = per_radius * (some(points.col(1), i, count) - centre.y());
    const Lanes z = per_radius * (some(points.col(2), i, count) - centre.z());
    const Lanes gx = some(gradients.col(0), i, count);
    const Lanes gy = some(gradients.col(1), i, count);
    const Lanes gz = some(gradients.col(2), i, count);
    sums.add({y * gz - z * gy, z * gx - x * gz, x * gy - y * gx, gx, gy, gz},
             some(residuals, i, count), some(weights, i, count));
  }
  const double scale = 1.0 / (sd_mm * sd_mm);
  std::size_t at = 0;
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b <= a; ++b)
      information.hessian(a, b) = information.hessian(b, a) = scale * sums.lanes[at++].sum();
    information.gradient[a] = scale * sums.lanes[kTriangle + static_cast<std::size_t>(a)].sum();
  }
  return information;
}

Mat3 rotation_information(const Mat6& hessian) {
  const Mat3 coupling = hessian.bottomLeftCorner<3, 3>();
  const Mat3 translation = hessian.bottomRightCorner<3, 3>();
  const Mat3 explained = coupling.transpose() * least_norm_solution(translation, coupling);
  return hessian.topLeftCorner<3, 3>() - 0.5 * (explained + explained.transpose());
}

Observability observability(const PoseInformation& information, double ratio) {
  Observability seen;
  seen.threshold = ratio;
  const double largest = symmetric_eigenvalues(information.hessian)[5];
  if (!(largest > 0.0)) {  // every point is an outlier and shows nothing
    seen.threshold = std::max(ratio, 1e-300);
    return seen;
  }
  const SymmetricEigen<3> rotation = symmetric_eigen(rotation_information(information.hessian));
  seen.rotation_ratios = rotation.values / largest;
  seen.rotation_axes = rotation.vectors;
  const SymmetricEigen<3> translation =
      symmetric_eigen(Mat3(information.hessian.bottomRightCorner<3, 3>()));
  seen.translation_ratios = translation.values / largest;
  seen.translation_axes = translation.vectors;
  return seen;
}

Mat6 pose_covariance(const PoseInformation& information, const Observability& seen, bool rotates,
                     double rotation_prior) {
  Mat6 known = information.hessian;
  Mat6 keep = Mat6::Identity();
  for (int k = 0; k < 3; ++k)
    if (!seen.translation_shown(k))
      keep.bottomRightCorner<3, 3>() -=
          seen.translation_axes.col(k) * seen.translation_axes.col(k).transpose();
  known = keep * known * keep;
  // Without the Schur complement's part along an axis, nothing is known of that rotation, and the
  // translation still goes along with it.
  const Mat3 rotation = rotation_information(known);
  Mat3 shown = Mat3::Zero();
  for (int k = 0; k < 3; ++k)
    if (rotates && seen.rotation_shown(k))
      shown += seen.rotation_axes.col(k) * seen.rotation_axes.col(k).transpose();
  known.topLeftCorner<3, 3>() += shown * rotation * shown - rotation;

  const double r = information.radius_mm;
  const double unknown_rotation = 1.0 / (kUnknownRotationSd_rad * kUnknownRotationSd_rad);
  const double unknown_translation = 1.0 / (kUnknownTranslationSd_mm * kUnknownTranslationSd_mm);
  known.diagonal().head<3>().array() += std::max(rotation_prior, unknown_rotation) / (r * r);
  known.diagonal().tail<3>().array() += unknown_translation;
  Mat6 covariance = symmetric_inverse(known);
  covariance.topRows<3>() /= r;
  covariance.leftCols<3>() /= r;
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace brainshift::registration
