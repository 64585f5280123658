// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid obstacles, and the contact pair of any point with one: closest point y, normal N out of
// the obstacle, and initial penetration 0p = (y - x) . N (contact_search.hpp; positive
// penetrates).
#pragma once

#include <variant>
#include <vector>

#include "common/contact/contact_search.hpp"

namespace brainshift::contact {

// The half-space behind the plane is rigid. The normal has length one and points to the side
// where the body may be.
struct RigidPlane {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
};
// A rigid ball; the body is outside.
struct RigidSphere {
  Vec3 centre = Vec3::Zero();
  double radius = 0.0;  // mm, > 0
};
// Triangles whose normals point out of the obstacle, to the side where the body may be.
struct RigidSurface {
  TriangleSurface surface;
};
using Obstacle = std::variant<RigidPlane, RigidSphere, RigidSurface>;

// One pair per point; `slave` is its column. kInvalidArgument: a point at the centre of the
// sphere. For a surface the errors of search_contact.
Result<std::vector<ContactPair>> contact_pairs(const Points& points, const Obstacle& obstacle);

}  // namespace brainshift::contact
