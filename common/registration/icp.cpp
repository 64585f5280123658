// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/icp.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "common/registration/rigid_increment.hpp"

namespace brainshift::registration {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;
// Points whose second principal spread is below this fraction of the first lie on a line.
constexpr double kCollinear = 1e-5;
// Closer than this (mm), the direction from the surface to a point is rounding; the triangle's normal is not.
constexpr double kTouching = 1e-7;
// The Welsch scale starts at this multiple of the median residual, so that half of the points pull with at
// least 0.88 of their weight, and shrinks by the factor per step until it is the one asked for.
constexpr double kStartOverMedian = 2.0;
constexpr double kScaleFactor = 0.6;
// Curvature below this fraction of the largest is taken for zero when a step is computed.
constexpr double kNullCurvature = 1e-9;
// Rotation that is left out: correspondences change along a step that was not taken, hence twice its size; and
// two standard deviations for what the points do not tell.
constexpr double kStepSafety = 2.0;
constexpr double kStandardDeviations = 2.0;

// What a pose gives: moved points, distances to the surface and their directions.
struct Fit {
  RigidTransform T = RigidTransform::Identity();
  Points moved;
  Points directions;             // unit, away from the surface; the distance's gradient
  VecX residuals;                // mm
  Vec3 rotation = Vec3::Zero();  // relative to the initial pose, radians
};

// Points' pull on the pose, in the coordinates (radius * w, t): both in mm.
struct Normal {
  Mat6 hessian = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();
  Vec3 centre = Vec3::Zero();
  double radius_mm = 1.0;
};

double largest_eigenvalue(const Mat6& hessian) {
  return Eigen::SelfAdjointEigenSolver<Mat6>(hessian, Eigen::EigenvaluesOnly).eigenvalues()[5];
}

// What is known of the rotation when the translation is not: the Schur complement.
Mat3 rotation_information(const Mat6& hessian) {
  const Mat3 coupling = hessian.bottomLeftCorner<3, 3>();
  const Mat3 translation = hessian.bottomRightCorner<3, 3>();
  const Mat3 explained =
      coupling.transpose() * translation.completeOrthogonalDecomposition().solve(coupling);
  return hessian.topLeftCorner<3, 3>() - 0.5 * (explained + explained.transpose());
}

Status check_options(const IcpOptions& options) {
  const auto positive = [](const char* name, double value) -> Status {
    if (std::isfinite(value) && value > 0.0) return {};
    return fail(ErrorCode::kInvalidArgument, fmt::format("icp.{} = {}: must be > 0", name, value));
  };
  for (const auto& [name, value] :
       {std::pair{"sd_mm", options.sd_mm}, std::pair{"welsch_scale_mm", options.welsch_scale_mm},
        std::pair{"max_iterations", static_cast<double>(options.max_iterations)},
        std::pair{"translation_tolerance_mm", options.translation_tolerance_mm},
        std::pair{"rotation_tolerance_deg", options.rotation_tolerance_deg}})
    if (auto status = positive(name, value); !status) return status;
  if (std::isnan(options.rotation_sd_deg))
    return fail(ErrorCode::kInvalidArgument, "icp.rotation_sd_deg = nan: must be a number");
  if (!(options.observability_ratio >= 0.0 && options.observability_ratio < 1.0))
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("icp.observability_ratio = {}: must be in [0, 1)",
                            options.observability_ratio));
  return {};
}

Status check_points(const Points& points, const RigidTransform& T) {
  if (points.cols() < 3)
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("boundary points: {} given, at least 3 needed", points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    if (!points.col(i).allFinite())
      return fail(ErrorCode::kNotFinite,
                  fmt::format("boundary points: point {} of {} is not finite", i, points.cols()));
  const Points centred = points.colwise() - points.rowwise().mean();
  const Vec3 spread =
      Eigen::SelfAdjointEigenSolver<Mat3>(centred * centred.transpose(), Eigen::EigenvaluesOnly)
          .eigenvalues();
  if (!(spread[1] > kCollinear * kCollinear * spread[2]))
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("boundary points: all {} lie on one line", points.cols()));
  if (!T.matrix().allFinite()) return fail(ErrorCode::kNotFinite, "initial pose: not finite");
  const double skew = (T.linear().transpose() * T.linear() - Mat3::Identity()).norm();
  if (skew > 1e-6 || T.linear().determinant() < 0.0)
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("initial pose: not a rotation (R^T R - I = {:.3g})", skew));
  return {};
}

class Icp {
 public:
  Icp(const Points& points, const geometry::ClosestPointIndex& surface,
      const RigidTransform& T_initial, const IcpOptions& options)
      : points_(points), surface_(surface), initial_pose_(T_initial), options_(options) {
    if (options.rotation_sd_deg > 0.0)
      prior_information_ = 1.0 / std::pow(options.rotation_sd_deg * kRadiansPerDegree, 2);
  }

  IcpResult run() const;

 private:
  Fit fit(const RigidTransform& T) const;
  double weight(double residual, double scale) const {
    return std::exp(-0.5 * residual * residual / (scale * scale));
  }
  double objective(const Fit& fit, double scale) const;
  Normal normal_equations(const Fit& fit, double scale) const;
  // An axis with less than `threshold` of curvature takes no step from the data.
  Vec6 step(const Fit& fit, const Normal& normal, double threshold, bool rotation) const;
  double left_out_rotation(const Fit& fit, const Normal& normal, double threshold) const;
  double start_scale(const Fit& fit) const;
  bool is_small(const Vec6& xi) const {
    return xi.head<3>().norm() <= options_.rotation_tolerance_deg * kRadiansPerDegree &&
           xi.tail<3>().norm() <= options_.translation_tolerance_mm;
  }
  void summarise(const Fit& fit, IcpResult& result) const;

  const Points& points_;
  const geometry::ClosestPointIndex& surface_;
  const RigidTransform& initial_pose_;
  const IcpOptions& options_;
  double prior_information_ = 0.0;  // 1 / rad^2
};

Fit Icp::fit(const RigidTransform& T) const {
  Fit fit;
  fit.T = T;
  fit.moved = (T.linear() * points_).colwise() + Vec3(T.translation());
  fit.directions.resize(3, points_.cols());
  fit.residuals.resize(points_.cols());
  for (Eigen::Index i = 0; i < points_.cols(); ++i) {
    const Vec3 x = fit.moved.col(i);
    const geometry::ClosestPoint closest = surface_.closest(x);
    const Vec3 away = x - closest.point;
    const Vec3 n = closest.distance_mm > kTouching ? Vec3(away / closest.distance_mm)
                                                   : surface_.triangle_normal(closest.triangle);
    fit.directions.col(i) = n;
    fit.residuals[i] = n.dot(away);
  }
  fit.rotation = rotation_vector(T.linear() * initial_pose_.linear().transpose());
  return fit;
}

// Welsch: 2 s^2 (1 - exp(-r^2 / 2 s^2)) is r^2 for small residuals and at most 2 s^2.
double Icp::objective(const Fit& fit, double scale) const {
  double sum = 0.0;
  for (const double r : fit.residuals)
    sum += -2.0 * scale * scale * std::expm1(-0.5 * r * r / (scale * scale));
  return sum / (options_.sd_mm * options_.sd_mm) + prior_information_ * fit.rotation.squaredNorm();
}

Normal Icp::normal_equations(const Fit& fit, double scale) const {
  Normal normal;
  normal.centre = fit.moved.rowwise().mean();
  normal.radius_mm =
      std::sqrt((fit.moved.colwise() - normal.centre).colwise().squaredNorm().mean());
  const double information = 1.0 / (options_.sd_mm * options_.sd_mm);
  for (Eigen::Index i = 0; i < fit.moved.cols(); ++i) {
    Vec6 row = direction_gradient(fit.moved.col(i), fit.directions.col(i), normal.centre);
    row.head<3>() /= normal.radius_mm;
    const double w = information * weight(fit.residuals[i], scale);
    normal.hessian.selfadjointView<Eigen::Lower>().rankUpdate(row, w);
    normal.gradient += w * fit.residuals[i] * row;
  }
  normal.hessian = normal.hessian.selfadjointView<Eigen::Lower>();
  return normal;
}

// Gauss-Newton. Along axes that the data do not show, the facets of the surface and the noise would still
// pull the pose a little way in an arbitrary direction: there only the prior speaks. Rotation goes first:
// where it can be traded against translation (a sphere seen from one side), the translation does the work.
Vec6 Icp::step(const Fit& fit, const Normal& normal, double threshold, bool rotates) const {
  Mat6 keep = Mat6::Identity();
  const Eigen::SelfAdjointEigenSolver<Mat3> rotation(rotation_information(normal.hessian));
  for (int k = 0; k < 3; ++k) {
    const Vec3 axis = rotation.eigenvectors().col(k);
    if (!rotates || rotation.eigenvalues()[k] < threshold)
      keep.topLeftCorner<3, 3>() -= axis * axis.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat6> data(keep * normal.hessian * keep);
  Mat6 hessian = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();
  for (int k = 0; k < 6; ++k) {
    if (data.eigenvalues()[k] < threshold) continue;
    const Vec6 axis = data.eigenvectors().col(k);
    hessian += data.eigenvalues()[k] * axis * axis.transpose();
    gradient += axis * axis.dot(normal.gradient);
  }
  const double information = prior_information_ / (normal.radius_mm * normal.radius_mm);
  // For |log R|^2 / 2 the gradient is log R itself; the Hessian is the identity to first order.
  hessian.diagonal().head<3>().array() += information;
  gradient.head<3>() += information * normal.radius_mm * fit.rotation;

  const Eigen::SelfAdjointEigenSolver<Mat6> all(hessian);
  Vec6 xi = Vec6::Zero();
  for (int k = 0; k < 6; ++k) {
    if (all.eigenvalues()[k] <= kNullCurvature * all.eigenvalues()[5]) continue;
    const Vec6 axis = all.eigenvectors().col(k);
    xi -= axis * (axis.dot(gradient) / all.eigenvalues()[k]);
  }
  xi.head<3>() /= normal.radius_mm;
  return xi;
}

double Icp::start_scale(const Fit& fit) const {
  std::vector<double> sizes(fit.residuals.data(), fit.residuals.data() + fit.residuals.size());
  for (double& r : sizes) r = std::abs(r);
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return std::max(options_.welsch_scale_mm, kStartOverMedian * *middle);
}

IcpResult Icp::run() const {
  IcpResult result;
  Fit current = fit(initial_pose_);
  double scale = start_scale(current);
  while (result.iterations < options_.max_iterations) {
    ++result.iterations;
    const Normal normal = normal_equations(current, scale);
    const double threshold = options_.observability_ratio * largest_eigenvalue(normal.hessian);
    Vec6 xi = step(current, normal, threshold, options_.rotation);
    // Correspondences change under the step; halve it until the objective itself goes down.
    const double before = objective(current, scale);
    Fit next = fit(rigid_increment(xi, normal.centre) * current.T);
    while (objective(next, scale) > before && !is_small(xi)) {
      xi *= 0.5;
      next = fit(rigid_increment(xi, normal.centre) * current.T);
    }
    if (objective(next, scale) <= before) current = std::move(next);
    if (scale <= options_.welsch_scale_mm && is_small(xi)) {
      result.converged = true;
      break;
    }
    scale = std::max(options_.welsch_scale_mm, kScaleFactor * scale);
  }
  summarise(current, result);
  return result;
}

void Icp::summarise(const Fit& fit, IcpResult& result) const {
  result.T_surface_points = fit.T;
  double sum = 0.0, weights = 0.0;
  for (const double r : fit.residuals) {
    const double w = weight(r, options_.welsch_scale_mm);
    sum += w * r * r;
    weights += w;
  }
  result.rms_mm = weights > 0.0 ? std::sqrt(sum / weights) : 0.0;

  const Normal normal = normal_equations(fit, options_.welsch_scale_mm);
  const Mat6& hessian = normal.hessian;
  const Vec6 eigenvalues =
      Eigen::SelfAdjointEigenSolver<Mat6>(hessian, Eigen::EigenvaluesOnly).eigenvalues();
  if (!(eigenvalues[5] > 0.0)) {  // every point is an outlier: nothing is observable
    result.left_out_rotation_mm =
        left_out_rotation(fit, normal, std::numeric_limits<double>::min());
    return;
  }
  const double threshold = options_.observability_ratio * eigenvalues[5];
  for (const double value : eigenvalues) result.observable_axes += value >= threshold ? 1 : 0;
  const Eigen::SelfAdjointEigenSolver<Mat3> rotation(rotation_information(hessian),
                                                     Eigen::EigenvaluesOnly);
  result.rotation_observable = rotation.eigenvalues()[0] >= threshold;
  result.left_out_rotation_mm = left_out_rotation(fit, normal, threshold);
}

double Icp::left_out_rotation(const Fit& fit, const Normal& normal, double threshold) const {
  const VecX information = Eigen::SelfAdjointEigenSolver<Mat3>(rotation_information(normal.hessian),
                                                               Eigen::EigenvaluesOnly)
                               .eigenvalues();
  if (options_.rotation && information[0] >= threshold) return 0.0;
  const Vec6 missed = step(fit, normal, 0.0, true);
  const Points arms = fit.moved.colwise() - normal.centre;
  double greatest = 0.0;
  for (const auto& arm : arms.colwise()) {
    const Vec3 move = missed.head<3>().cross(Vec3(arm)) + missed.tail<3>();
    greatest = std::max(greatest, move.norm());
  }
  // The least visible axis is among those left out.
  const double known =
      std::max(0.0, information[0]) * normal.radius_mm * normal.radius_mm + prior_information_;
  const double arm_mm = arms.colwise().norm().maxCoeff();
  return kStepSafety * greatest + kStandardDeviations * arm_mm / std::sqrt(known);
}

}  // namespace

Result<IcpResult> align(const Points& points, const geometry::ClosestPointIndex& surface,
                        const RigidTransform& T_surface_points_initial, const IcpOptions& options) {
  if (auto status = check_options(options); !status) return tl::unexpected(status.error());
  if (auto status = check_points(points, T_surface_points_initial); !status)
    return tl::unexpected(status.error());
  return Icp(points, surface, T_surface_points_initial, options).run();
}

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
