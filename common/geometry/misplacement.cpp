// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/misplacement.hpp"

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

}  // namespace brainshift::geometry
