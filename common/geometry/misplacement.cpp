// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/misplacement.hpp"

#include <fmt/format.h>

#include <cmath>

namespace brainshift::geometry {
namespace {

// What is measured of a head.
constexpr double kSmallest_mm = 3.0, kLargest_mm = 500.0;

}  // namespace

std::string likely_mistake(const Points& points, const std::function<bool(const Points&)>& fits) {
  struct Mistake {
    const char* what;
    Vec3 factors;  // that undo it
  };
  static const Mistake kMistakes[] = {
      {"in LPS instead of RAS", Vec3(-1, -1, 1)},
      {"in metres instead of millimetres", Vec3::Constant(1000.0)},
      {"in metres, and in LPS instead of RAS", Vec3(-1000, -1000, 1000)},
      {"in centimetres instead of millimetres", Vec3::Constant(10.0)},
      {"in micrometres instead of millimetres", Vec3::Constant(0.001)},
      {"with left and right exchanged", Vec3(-1, 1, 1)}};
  if (points.cols() == 0 || !points.allFinite()) return {};
  for (const Mistake& mistake : kMistakes) {
    const Points meant = mistake.factors.asDiagonal() * points;
    const double extent = (meant.rowwise().maxCoeff() - meant.rowwise().minCoeff()).maxCoeff();
    // Nearly a point lies nearly anywhere.
    if (extent < kSmallest_mm || extent > kLargest_mm) continue;
    if (fits(meant)) return std::string("; ") + mistake.what + "?";
  }
  return {};
}

std::string metres_for_millimetres(const Vec3& x, const std::function<bool(const Vec3&)>& fits) {
  constexpr double kNear_mm = 0.5, kPerMetre = 1000.0;
  const double away = x.norm();
  const Vec3 meant = kPerMetre * x;
  if (!(away > 0.0 && away <= kNear_mm) || !fits(meant)) return {};
  return fmt::format(
      "lies within {:.1f} mm of the origin; in metres it would be ({:.1f}, {:.1f}, {:.1f}) mm",
      std::ceil(10.0 * away) / 10.0, meant.x(), meant.y(), meant.z());
}

}  // namespace brainshift::geometry
