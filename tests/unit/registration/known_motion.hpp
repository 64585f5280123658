// SPDX-License-Identifier: GPL-3.0-or-later
// Known rigid motions of a tumour, and how far a recovered one is from them.
#pragma once

#include <algorithm>
#include <numbers>

#include "common/core/random.hpp"
#include "common/core/types.hpp"
#include "common/registration/pose_information.hpp"

namespace brainshift::registration::test {

inline constexpr double kDegree = std::numbers::pi / 180.0;
// Centre of the tumour, mm RAS.
inline const Vec3 kCentre(35, -45, 20);

// A motion of the given size about the tumour's centre, in random directions.
inline RigidTransform motion(Random& random, double translation_mm, double rotation_deg) {
  Vec6 xi;
  xi << rotation_deg * kDegree * random.direction(), translation_mm * random.direction();
  return rigid_increment(xi, kCentre);
}

// Largest distance between the places to which the two transforms move the points, mm.
inline double placement_error(const RigidTransform& a, const RigidTransform& b,
                              const Points& points) {
  double worst = 0.0;
  for (const Vec3 x : points.colwise()) worst = std::max(worst, (a * x - b * x).norm());
  return worst;
}

}  // namespace brainshift::registration::test
