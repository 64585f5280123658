// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/icp_input.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "common/core/small_matrices.hpp"

namespace brainshift::registration {
namespace {

// Below this ratio of the second principal spread to the first, the points lie on a line up to the
// rounding of their coordinates. align() accepts thinner shapes than register_fiducials(), because
// it reports the axes that they do not show.
constexpr double kThinnestCloud = 1e-5;

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
  const Vec3 spread = symmetric_eigenvalues(Mat3(centred * centred.transpose()));
  if (!(spread[1] > kThinnestCloud * kThinnestCloud * spread[2]))
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("boundary points: all {} lie on one line", points.cols()));
  if (!T.matrix().allFinite()) return fail(ErrorCode::kNotFinite, "initial pose: not finite");
  const double skew = (T.linear().transpose() * T.linear() - Mat3::Identity()).norm();
  if (skew > 1e-6 || T.linear().determinant() < 0.0)
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("initial pose: not a rotation (R^T R - I = {:.3g})", skew));
  return {};
}

}  // namespace

Status check_alignment(const Points& points, const RigidTransform& T_surface_points_initial,
                       const IcpOptions& options) {
  if (Status status = check_options(options); !status) return status;
  return check_points(points, T_surface_points_initial);
}

}  // namespace brainshift::registration
