// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/obstacle.hpp"

#include <numeric>

namespace brainshift::contact {
namespace {

using Pairs = Result<std::vector<ContactPair>>;

Pairs with_plane(const Points& points, const RigidPlane& plane) {
  std::vector<ContactPair> pairs;
  for (int i = 0; i < points.cols(); ++i) {
    const double penetration = (plane.point - points.col(i)).dot(plane.normal);
    pairs.push_back({i, points.col(i) + penetration * plane.normal, plane.normal, penetration});
  }
  return pairs;
}

Pairs with_sphere(const Points& points, const RigidSphere& sphere) {
  std::vector<ContactPair> pairs;
  for (int i = 0; i < points.cols(); ++i) {
    const Vec3 out = points.col(i) - sphere.centre;
    const double distance = out.norm();
    if (!(distance > 1e-6 * sphere.radius)) {
      return fail(ErrorCode::kInvalidArgument,
                  "a point of the surface lies in the centre of the rigid sphere");
    }
    const Vec3 normal = out / distance;
    pairs.push_back({i, sphere.centre + sphere.radius * normal, normal, sphere.radius - distance});
  }
  return pairs;
}

Pairs with_surface(const Points& points, const RigidSurface& obstacle) {
  // search_contact expects a surface that looks away from the body, as a skull does from the
  // brain.
  TriangleSurface flipped = obstacle.surface;
  flipped.triangles.row(1).swap(flipped.triangles.row(2));
  std::vector<NodeIndex> all(static_cast<std::size_t>(points.cols()));
  std::iota(all.begin(), all.end(), 0);
  return search_contact(points, all, flipped);
}

}  // namespace

Result<std::vector<ContactPair>> contact_pairs(const Points& points, const Obstacle& obstacle) {
  if (const auto* plane = std::get_if<RigidPlane>(&obstacle)) return with_plane(points, *plane);
  if (const auto* sphere = std::get_if<RigidSphere>(&obstacle)) return with_sphere(points, *sphere);
  return with_surface(points, std::get<RigidSurface>(obstacle));
}

}  // namespace brainshift::contact
