// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/ultrasound/boundary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace brainshift::ultrasound {
namespace {

constexpr double kMaxPoints = 1e6;

Status check_contour(const Contour& contour, double spacing_mm) {
  if (!(spacing_mm > 0.0)) {
    return invalid(fmt::format("boundary spacing = {} mm: must be > 0", spacing_mm));
  }
  const int least = contour.closed ? 3 : 2;
  if (contour.points_px.cols() < least) {
    return invalid(fmt::format("contour of frame {} has {} points: must have at least {}",
                               contour.frame, contour.points_px.cols(), least));
  }
  if (!contour.points_px.allFinite()) {
    return fail(ErrorCode::kNotFinite,
                fmt::format("contour of frame {} holds a value that is not a finite number",
                            contour.frame));
  }
  return {};
}

}  // namespace

Result<Points> boundary_points(const Contour& contour, const AffineTransform& T_target_image,
                               double spacing_mm) {
  if (Status ok = check_contour(contour, spacing_mm); !ok) return tl::unexpected(ok.error());
  const Eigen::Index corners = contour.points_px.cols();
  Points line(3, corners + (contour.closed ? 1 : 0));
  for (Eigen::Index i = 0; i < corners; ++i) {
    line.col(i) = T_target_image * Vec3(contour.points_px(0, i), contour.points_px(1, i), 0.0);
  }
  if (contour.closed) line.col(corners) = line.col(0);
  // Arc length up to each corner.
  std::vector<double> length(static_cast<std::size_t>(line.cols()), 0.0);
  for (Eigen::Index i = 1; i < line.cols(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    length[at] = length[at - 1] + (line.col(i) - line.col(i - 1)).norm();
  }
  const double total = length.back();
  const double steps = std::max(1.0, std::round(total / spacing_mm));
  if (!(total > 0.0) || !(steps <= kMaxPoints)) {
    return invalid(
        fmt::format("contour of frame {} is {:.3g} mm long: must be > 0 and at most {:.3g}",
                    contour.frame, total, kMaxPoints * spacing_mm));
  }
  const auto count = static_cast<Eigen::Index>(steps) + (contour.closed ? 0 : 1);
  Points points(3, count);
  std::size_t corner = 1;
  for (Eigen::Index k = 0; k < count; ++k) {
    const double s = total * static_cast<double>(k) / steps;
    while (corner + 1 < length.size() && length[corner] < s) ++corner;
    const double side = length[corner] - length[corner - 1];
    const double a = side > 0.0 ? std::clamp((s - length[corner - 1]) / side, 0.0, 1.0) : 0.0;
    const auto end = static_cast<Eigen::Index>(corner);
    points.col(k) = (1.0 - a) * line.col(end - 1) + a * line.col(end);
  }
  return points;
}

}  // namespace brainshift::ultrasound
