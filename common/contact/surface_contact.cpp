// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/surface_contact.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

#include "common/fem/elasticity.hpp"

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

SurfaceContact::SurfaceContact(const fem::DisplacementSpace& space) : space_(&space) {}

Status SurfaceContact::add(const Eigen::Matrix<int, 3, Eigen::Dynamic>& faces,
                           const Obstacle& obstacle, double kappa) {
  assert(kappa > 0.0);
  const auto& rule = space_->element == fem::Element::kP1 ? fem::coarse_triangle_rule()
                                                          : fem::fine_triangle_rule();
  std::vector<SurfaceContactPoint> added;
  Points places(3, faces.cols() * static_cast<Eigen::Index>(rule.size()));
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    const Eigen::Vector3i face = faces.col(f);
    Mat3 corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = space_->mesh.nodes.col(face[k]);
    const double area =
        0.5 * (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0)).norm();
    for (const fem::TrianglePoint& q : rule) {
      SurfaceContactPoint point;
      point.nodes = fem::face_nodes(*space_, face);
      const auto shape = fem::face_shape_values(space_->element, q.l);
      std::copy(shape.begin(), shape.end(), point.shape.begin());
      std::copy(q.l.begin(), q.l.end(), point.vertex_weight.begin());
      point.area = q.weight * area;
      point.stiffness = kappa * point.area;
      point.obstacle = num_obstacles_;
      places.col(static_cast<Eigen::Index>(added.size())) = corners * q.l;
      added.push_back(point);
    }
  }
  const auto pairs = contact_pairs(places, obstacle);
  if (!pairs) return tl::unexpected(pairs.error());
  for (std::size_t i = 0; i < added.size(); ++i) {
    added[i].normal = (*pairs)[i].normal;
    added[i].initial_penetration_mm = (*pairs)[i].initial_penetration_mm;
  }
  points_.insert(points_.end(), added.begin(), added.end());
  ++num_obstacles_;
  return {};
}

VecX SurfaceContact::approach(const Points& u) const {
  VecX along(num_points());
  for (int i = 0; i < num_points(); ++i) {
    const SurfaceContactPoint& point = points_[static_cast<std::size_t>(i)];
    double sum = 0.0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(space_->nodes_per_face()); ++k) {
      sum += point.shape[k] * point.normal.dot(u.col(point.nodes[k]));
    }
    along[i] = sum;
  }
  return along;
}

VecX SurfaceContact::penetration(const Points& u) const {
  VecX p = -approach(u);
  for (int i = 0; i < num_points(); ++i) {
    p[i] += points_[static_cast<std::size_t>(i)].initial_penetration_mm;
  }
  return p;
}

void SurfaceContact::add_stiffness(linalg::SymmetricMatrix& lower, const fem::DofMap& dofs,
                                   const ActiveSet& active) const {
  const auto n = static_cast<std::size_t>(space_->nodes_per_face());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!active[i]) continue;
    const SurfaceContactPoint& point = points_[i];
    const Mat3 direction = point.stiffness * point.normal * point.normal.transpose();
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t b = 0; b < n; ++b) {
        if (point.nodes[a] < point.nodes[b]) continue;
        fem::add_block(lower, dofs, point.nodes[a], point.nodes[b],
                       point.shape[a] * point.shape[b] * direction);
      }
    }
  }
}

void SurfaceContact::add_force(const VecX& values, const ActiveSet& active, Points& force) const {
  const auto n = static_cast<std::size_t>(space_->nodes_per_face());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!active[i]) continue;
    const SurfaceContactPoint& point = points_[i];
    const Vec3 push = point.stiffness * values[static_cast<Eigen::Index>(i)] * point.normal;
    for (std::size_t k = 0; k < n; ++k) force.col(point.nodes[k]) += point.shape[k] * push;
  }
}

VecX SurfaceContact::vertex_pressure(const Points& u) const {
  const VecX p = penetration(u);
  VecX force = VecX::Zero(space_->num_vertices());
  VecX area = VecX::Zero(space_->num_vertices());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const SurfaceContactPoint& point = points_[i];
    const double pressed = std::max(0.0, p[static_cast<Eigen::Index>(i)]);
    for (std::size_t k = 0; k < 3; ++k) {
      force[point.nodes[k]] += point.vertex_weight[k] * point.stiffness * pressed;
      area[point.nodes[k]] += point.vertex_weight[k] * point.area;
    }
  }
  return (area.array() > 0.0).select(force.array() / area.array(), 0.0);
}

}  // namespace brainshift::contact
