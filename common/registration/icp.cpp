// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/icp.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace brainshift::registration {
namespace {

using geometry::PointRows;

// Closer than this (mm), the direction from the surface to a point is rounding. The triangle's
// normal is not.
constexpr double kTouching = 1e-7;

}  // namespace

TargetSurface::TargetSurface(const geometry::ClosestPointIndex& triangles)
    : measure_([&triangles](const PointRows& points, VecX& distances_mm, PointRows& gradients) {
        for (Eigen::Index i = 0; i < points.rows(); ++i) {
          const Vec3 x = points.row(i);
          const geometry::ClosestPoint closest = triangles.closest(x);
          const Vec3 away = x - closest.point;
          const Vec3 n = closest.distance_mm > kTouching
                             ? Vec3(away / closest.distance_mm)
                             : triangles.triangle_normal(closest.triangle);
          gradients.row(i) = n;
          distances_mm[i] = n.dot(away);
        }
      }) {}

TargetSurface::TargetSurface(const geometry::DistanceVolume& volume)
    : measure_([&volume](const PointRows& points, VecX& distances_mm, PointRows& gradients) {
        volume.at(points, distances_mm, gradients);
      }) {}

namespace {

// Below this ratio of the second principal spread to the first, the points lie on a line up to the
// rounding of their coordinates. align() accepts thinner shapes than register_fiducials(), because
// it reports the axes that they do not show.
constexpr double kThinnestCloud = 1e-5;

Status check_options(const IcpOptions& options) {
  const auto positive = [](const char* name, double value) -> Status {
    if (std::isfinite(value) && value > 0.0) return {};
    return invalid(fmt::format("icp.{} = {}: must be > 0", name, value));
  };
  for (const auto& [name, value] :
       {std::pair{"sd_mm", options.sd_mm}, std::pair{"welsch_scale_mm", options.welsch_scale_mm},
        std::pair{"max_iterations", static_cast<double>(options.max_iterations)},
        std::pair{"translation_tolerance_mm", options.translation_tolerance_mm},
        std::pair{"rotation_tolerance_deg", options.rotation_tolerance_deg}})
    if (auto status = positive(name, value); !status) return status;
  if (std::isnan(options.rotation_sd_deg))
    return invalid("icp.rotation_sd_deg = nan: must be a number");
  if (!(options.observability_ratio >= 0.0 && options.observability_ratio < 1.0))
    return invalid(fmt::format("icp.observability_ratio = {}: must be in [0, 1)",
                               options.observability_ratio));
  return {};
}

Status check_points(const Points& points, const RigidTransform& T) {
  if (points.cols() < 3)
    return invalid(fmt::format("boundary points: {} given, at least 3 needed", points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    if (!points.col(i).allFinite())
      return fail(ErrorCode::kNotFinite,
                  fmt::format("boundary points: point {} of {} is not finite", i, points.cols()));
  const Points centred = points.colwise() - points.rowwise().mean();
  const Vec3 spread = symmetric_eigenvalues(Mat3(centred * centred.transpose()));
  if (!(spread[1] > kThinnestCloud * kThinnestCloud * spread[2]))
    return invalid(fmt::format("boundary points: all {} lie on one line", points.cols()));
  if (!T.matrix().allFinite()) return fail(ErrorCode::kNotFinite, "initial pose: not finite");
  const double skew = (T.linear().transpose() * T.linear() - Mat3::Identity()).norm();
  if (skew > 1e-6 || T.linear().determinant() < 0.0)
    return invalid(fmt::format("initial pose: not a rotation (R^T R - I = {:.3g})", skew));
  return {};
}

constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;
// The Welsch scale starts at this multiple of the median residual: half of the points then pull
// with at least 0.88 of their weight. It shrinks by the factor per step until it is the one asked
// for.
constexpr double kStartOverMedian = 2.0;
constexpr double kScaleFactor = 0.6;
// Curvature below this fraction of the largest is taken for zero when a step is computed.
constexpr double kNullCurvature = 1e-9;
// Rotation that is left out. Correspondences change along a step that was not taken, hence twice
// its size; and two standard deviations for what the points do not tell.
constexpr double kStepSafety = 2.0;
constexpr double kStandardDeviations = 2.0;
// Below this, 1 - exp(-x) is summed as a series, since the difference would lose its digits.
constexpr double kSeries = 1e-3;

// What a pose gives: moved points, distances to the surface and their directions.
struct Fit {
  RigidTransform T = RigidTransform::Identity();
  PointRows moved;
  PointRows gradients;  // of the distances, away from the surface
  VecX residuals;       // mm
  Vec3 rotation;        // relative to the initial pose, radians
  // For the scale last asked for:
  double scale_mm = 0.0;
  VecX weights;
  double objective = 0.0;

  explicit Fit(Eigen::Index points)
      : moved(points, 3), gradients(points, 3), residuals(points), weights(points) {}
};

class Icp {
 public:
  Icp(const Points& points, const TargetSurface& surface, const RigidTransform& T_initial,
      const IcpOptions& options);
  Result<IcpResult> run();

 private:
  void move(const RigidTransform& T, Fit& fit) const;
  void weigh(double scale_mm, Fit& fit) const;
  PoseInformation information(const Fit& fit) const {
    return pose_information(fit.moved, fit.gradients, fit.residuals, fit.weights, options_.sd_mm,
                            fit.T * centroid_, radius_mm_);
  }
  // An axis with less than `threshold` of curvature takes no step from the data.
  Vec6 step(const Fit& fit, const PoseInformation& points, double threshold, bool rotates) const;
  bool descend(const PoseInformation& data, Vec6 xi);
  double left_out_rotation(const Fit& fit, const PoseInformation& data, double threshold) const;
  double start_scale() const;
  bool is_small(const Vec6& xi) const {
    return xi.head<3>().norm() <= options_.rotation_tolerance_deg * kRadiansPerDegree &&
           xi.tail<3>().norm() <= options_.translation_tolerance_mm;
  }
  void summarise(IcpResult& result);

  const PointRows points_;
  const TargetSurface& surface_;
  const RigidTransform& initial_pose_;
  const IcpOptions& options_;
  // Aligned, because the rounding of Eigen's mean over columns depends on the address it writes to.
  alignas(16) Vec3 centroid_;
  double radius_mm_;
  double prior_information_ = 0.0;  // 1 / rad^2
  Fit current_, next_;
};

Icp::Icp(const Points& points, const TargetSurface& surface, const RigidTransform& T_initial,
         const IcpOptions& options)
    : points_(points.transpose()),
      surface_(surface),
      initial_pose_(T_initial),
      options_(options),
      centroid_(points.rowwise().mean()),
      radius_mm_(std::sqrt((points.colwise() - centroid_).colwise().squaredNorm().mean())),
      current_(points.cols()),
      next_(points.cols()) {
  if (options.rotation_sd_deg > 0.0)
    prior_information_ = 1.0 / std::pow(options.rotation_sd_deg * kRadiansPerDegree, 2);
}

void Icp::move(const RigidTransform& T, Fit& fit) const {
  fit.T = T;
  fit.moved = points_.lazyProduct(T.linear().transpose());
  fit.moved.rowwise() += T.translation().transpose();
  surface_.measure(fit.moved, fit.residuals, fit.gradients);
  fit.rotation = rotation_vector(T.linear() * initial_pose_.linear().transpose());
  fit.scale_mm = 0.0;
}

// Welsch: 2 s^2 (1 - exp(-r^2 / 2 s^2)) is r^2 for small residuals and at most 2 s^2.
void Icp::weigh(double scale_mm, Fit& fit) const {
  if (fit.scale_mm == scale_mm) return;
  fit.scale_mm = scale_mm;
  const double per_scale = 0.5 / (scale_mm * scale_mm);
  fit.weights = (-per_scale * fit.residuals.array().square()).exp();
  double sum = 0.0;
  for (Eigen::Index i = 0; i < fit.residuals.size(); ++i) {
    const double x = per_scale * fit.residuals[i] * fit.residuals[i];
    sum += x < kSeries ? x * (1.0 - x / 2.0 * (1.0 - x / 3.0)) : 1.0 - fit.weights[i];
  }
  fit.objective = sum / (per_scale * options_.sd_mm * options_.sd_mm) +
                  prior_information_ * fit.rotation.squaredNorm();
}

// Gauss-Newton. Along axes that the data do not show, the facets of the surface and the noise
// would still pull the pose a little way in an arbitrary direction, so only the prior acts there.
// Rotation axes are removed first: where a rotation can be traded against a translation (a sphere
// seen from one side), the translation does the work.
Vec6 Icp::step(const Fit& fit, const PoseInformation& points, double threshold,
               bool rotates) const {
  Mat6 keep = Mat6::Identity();
  const SymmetricEigen<3> rotation = symmetric_eigen(rotation_information(points.hessian));
  for (int k = 0; k < 3; ++k) {
    const Vec3 axis = rotation.vectors.col(k);
    if (!rotates || rotation.values[k] < threshold)
      keep.topLeftCorner<3, 3>() -= axis * axis.transpose();
  }
  const SymmetricEigen<6> data = symmetric_eigen(Mat6(keep * points.hessian * keep));
  Mat6 hessian = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();
  for (int k = 0; k < 6; ++k) {
    if (data.values[k] < threshold) continue;
    const Vec6 axis = data.vectors.col(k);
    hessian += data.values[k] * axis * axis.transpose();
    gradient += axis * axis.dot(points.gradient);
  }
  const double information = prior_information_ / (points.radius_mm * points.radius_mm);
  // For |log R|^2 / 2 the gradient is log R itself; the Hessian is the identity to first order.
  hessian.diagonal().head<3>().array() += information;
  gradient.head<3>() += information * points.radius_mm * fit.rotation;

  const SymmetricEigen<6> all = symmetric_eigen(hessian);
  Vec6 xi = Vec6::Zero();
  for (int k = 0; k < 6; ++k) {
    if (all.values[k] <= kNullCurvature * all.values[5]) continue;
    const Vec6 axis = all.vectors.col(k);
    xi -= axis * (axis.dot(gradient) / all.values[k]);
  }
  xi.head<3>() /= points.radius_mm;
  return xi;
}

double Icp::start_scale() const {
  VecX sizes = current_.residuals.cwiseAbs();
  double* middle = sizes.data() + sizes.size() / 2;
  std::nth_element(sizes.data(), middle, sizes.data() + sizes.size());
  return std::max(options_.welsch_scale_mm, kStartOverMedian * *middle);
}

// Correspondences change under the step, so it is halved until the objective itself goes down.
// True when the remaining step is within the tolerances.
bool Icp::descend(const PoseInformation& data, Vec6 xi) {
  const auto attempt = [&] {
    move(rigid_increment(xi, data.centre) * current_.T, next_);
    weigh(current_.scale_mm, next_);
    return next_.objective <= current_.objective;
  };
  bool down = attempt();
  while (!down && !is_small(xi)) {
    xi *= 0.5;
    down = attempt();
  }
  if (down) std::swap(current_, next_);
  return is_small(xi);
}

Result<IcpResult> Icp::run() {
  IcpResult result;
  move(initial_pose_, current_);
  double scale = start_scale();
  while (result.iterations < options_.max_iterations && !result.converged) {
    if (options_.stop.stop_requested()) {
      return fail(ErrorCode::kNotConverged, "the alignment was stopped");
    }
    ++result.iterations;
    weigh(scale, current_);
    const PoseInformation data = information(current_);
    const double largest = symmetric_eigenvalues(data.hessian)[5];
    const Vec6 xi = step(current_, data, options_.observability_ratio * largest, options_.rotation);
    result.converged = descend(data, xi) && scale <= options_.welsch_scale_mm;
    scale = std::max(options_.welsch_scale_mm, kScaleFactor * scale);
  }
  summarise(result);
  return result;
}

void Icp::summarise(IcpResult& result) {
  weigh(options_.welsch_scale_mm, current_);
  const PoseInformation data = information(current_);
  const double weights = current_.weights.sum();
  const double sum = current_.weights.dot(current_.residuals.cwiseAbs2());
  result.T_surface_points = current_.T;
  result.rms_mm = weights > 0.0 ? std::sqrt(sum / weights) : 0.0;
  result.centre = data.centre;
  result.observability = observability(data, options_.observability_ratio);
  result.pose_covariance =
      pose_covariance(data, result.observability, options_.rotation, prior_information_);
  result.weights = current_.weights;

  const Vec6 eigenvalues = symmetric_eigenvalues(data.hessian);
  double threshold = options_.observability_ratio * eigenvalues[5];
  if (eigenvalues[5] > 0.0) {
    for (const double value : eigenvalues) result.observable_axes += value >= threshold ? 1 : 0;
    result.rotation_observable = result.observability.rotation_shown(0);
  } else {  // every point is an outlier: nothing is observable
    threshold = std::numeric_limits<double>::min();
  }
  result.left_out_rotation_mm = left_out_rotation(current_, data, threshold);
}

double Icp::left_out_rotation(const Fit& fit, const PoseInformation& data, double threshold) const {
  const Vec3 known = symmetric_eigenvalues(rotation_information(data.hessian));
  if (options_.rotation && known[0] >= threshold) return 0.0;
  const Vec6 missed = step(fit, data, 0.0, true);
  double greatest = 0.0, longest = 0.0;
  for (Eigen::Index i = 0; i < fit.moved.rows(); ++i) {
    const Vec3 arm = fit.moved.row(i).transpose() - data.centre;
    const Vec3 move = missed.head<3>().cross(arm) + missed.tail<3>();
    greatest = std::max(greatest, move.norm());
    longest = std::max(longest, arm.norm());
  }
  // The least visible axis is among those left out.
  const double information =
      std::max(0.0, known[0]) * data.radius_mm * data.radius_mm + prior_information_;
  return kStepSafety * greatest + kStandardDeviations * longest / std::sqrt(information);
}

}  // namespace

Result<IcpResult> align(const Points& points, const TargetSurface& surface,
                        const RigidTransform& T_surface_points_initial, const IcpOptions& options) {
  Status status = check_options(options);
  if (status) status = check_points(points, T_surface_points_initial);
  if (!status) return tl::unexpected(status.error());
  return Icp(points, surface, T_surface_points_initial, options).run();
}

}  // namespace brainshift::registration
