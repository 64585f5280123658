// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/closest_point.hpp"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

namespace brainshift::geometry {
namespace {

// Fraction along an edge of the point closest to one whose projection on the edge is `along` of
// length^2.
double clamped(double along, double length_squared) {
  return std::clamp(along / length_squared, 0.0, 1.0);
}

// Distances need no exact predicates; `contains` takes a vote of three rays instead.
using TriangleKernel = CGAL::Simple_cartesian<double>;
using Triangle = TriangleKernel::Triangle_3;
using Primitive =
    CGAL::AABB_triangle_primitive<TriangleKernel, std::vector<Triangle>::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<TriangleKernel, Primitive>>;

// Twice the area over the longest edge squared; flatter triangles have no usable normal. Their
// points lie on the edges of their neighbours, so nothing is lost by leaving them out.
constexpr double kFlat = 1e-12;
// Barycentric weight below which the closest point counts as lying on the opposite edge.
constexpr double kOnEdge = 1e-9;

// A ray that grazes an edge may count it twice or not at all, so three rays vote. Their directions
// are fixed, so that the answer is reproducible, and skew, so that no ray meets the surfaces of a
// grid edge-on.
constexpr double kRayDirections[3][3] = {
    {0.3713, 0.5477, 0.7497}, {-0.8271, 0.2179, 0.5182}, {0.4583, -0.7941, -0.3992}};

TriangleKernel::Point_3 to_cgal(const Vec3& x) { return {x[0], x[1], x[2]}; }

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

TriangleFrame::TriangleFrame(const Vec3& corner, const Vec3& b, const Vec3& c)
    : a(corner), ab(b - corner), ac(c - corner), ab_ab(ab.squaredNorm()), ab_ac(ab.dot(ac)) {
  ac_ac = ac.squaredNorm();
  determinant = ab_ab * ac_ac - ab_ac * ab_ac;
}

Vec3 closest_on_triangle(const TriangleFrame& t, const Vec3& x) {
  const Vec3 ax = x - t.a;
  const double ab_ax = t.ab.dot(ax), ac_ax = t.ac.dot(ax);
  // a + u ab + v ac is the foot of the perpendicular (normal equations, times the determinant).
  const double u = t.ac_ac * ab_ax - t.ab_ac * ac_ax;
  const double v = t.ab_ab * ac_ax - t.ab_ac * ab_ax;
  if (u >= 0.0 && v >= 0.0 && u + v <= t.determinant)
    return t.a + (u * t.ab + v * t.ac) / t.determinant;
  const Vec3 on_ab = t.a + clamped(ab_ax, t.ab_ab) * t.ab;
  const Vec3 on_ac = t.a + clamped(ac_ax, t.ac_ac) * t.ac;
  const Vec3 bc = t.ac - t.ab;
  const Vec3 on_bc = t.a + t.ab + clamped(bc.dot(ax - t.ab), bc.squaredNorm()) * bc;
  const double d_ab = (x - on_ab).squaredNorm(), d_ac = (x - on_ac).squaredNorm(),
               d_bc = (x - on_bc).squaredNorm();
  if (d_ab <= d_ac) return d_ab <= d_bc ? on_ab : on_bc;
  return d_ac <= d_bc ? on_ac : on_bc;
}

struct ClosestPointIndex::Impl {
  TriangleSurface surface;
  Points face_normals;    // unit; zero for a triangle without area
  Points edge_normals;    // 3 x 3t: sum of the face normals at edge k of triangle t, column 3t + k
  Points vertex_normals;  // sum of the face normals times their angles at the vertex
  std::vector<int> triangle_of_primitive;
  std::vector<Triangle> primitives;
  Tree tree;
  CGAL::Bbox_3 box;

  Vec3 vertex(int triangle, int corner) const {
    return surface.vertices.col(surface.triangles(corner, triangle));
  }
  void find_faces();
  void find_pseudo_normals();
};

void ClosestPointIndex::Impl::find_faces() {
  face_normals = Points::Zero(3, surface.num_triangles());
  for (int t = 0; t < surface.num_triangles(); ++t) {
    const Vec3 a = vertex(t, 0), b = vertex(t, 1), c = vertex(t, 2);
    const Vec3 n = (b - a).cross(c - a);
    const double longest =
        std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    if (!(n.norm() > kFlat * longest)) continue;
    face_normals.col(t) = n.normalized();
    primitives.emplace_back(to_cgal(a), to_cgal(b), to_cgal(c));
    triangle_of_primitive.push_back(t);
  }
}

void ClosestPointIndex::Impl::find_pseudo_normals() {
  vertex_normals = Points::Zero(3, surface.num_vertices());
  std::map<std::pair<int, int>, Vec3> sums;
  const auto edge_of = [&](int t, int k) {
    return std::minmax(surface.triangles(k, t), surface.triangles((k + 1) % 3, t));
  };
  for (int t = 0; t < surface.num_triangles(); ++t) {
    const Vec3 n = face_normals.col(t);
    for (int k = 0; k < 3; ++k) {
      const Vec3 x = vertex(t, k);
      const double angle = angle_between(vertex(t, (k + 1) % 3) - x, vertex(t, (k + 2) % 3) - x);
      vertex_normals.col(surface.triangles(k, t)) += angle * n;
      sums.try_emplace(edge_of(t, k), Vec3::Zero()).first->second += n;
    }
  }
  edge_normals.resize(3, 3 * surface.num_triangles());
  for (int t = 0; t < surface.num_triangles(); ++t)
    for (int k = 0; k < 3; ++k) edge_normals.col(3 * t + k) = sums.at(edge_of(t, k));
}

ClosestPointIndex::ClosestPointIndex(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ClosestPointIndex::ClosestPointIndex(ClosestPointIndex&&) noexcept = default;
ClosestPointIndex& ClosestPointIndex::operator=(ClosestPointIndex&&) noexcept = default;
ClosestPointIndex::~ClosestPointIndex() = default;

Result<ClosestPointIndex> ClosestPointIndex::build(const TriangleSurface& surface) {
  if (surface.num_triangles() == 0) return fail(ErrorCode::kEmptySet, "surface: no triangle");
  for (int v = 0; v < surface.num_vertices(); ++v)
    if (!surface.vertices.col(v).allFinite())
      return fail(ErrorCode::kNotFinite, fmt::format("surface: vertex {} is not finite", v));
  for (int t = 0; t < surface.num_triangles(); ++t)
    if (surface.triangles.col(t).minCoeff() < 0 ||
        surface.triangles.col(t).maxCoeff() >= surface.num_vertices())
      return invalid(fmt::format("surface: triangle {} names a vertex outside 0..{}", t,
                                 surface.num_vertices() - 1));
  auto impl = std::make_unique<Impl>();
  impl->surface = surface;
  impl->find_faces();
  if (impl->primitives.empty())
    return fail(ErrorCode::kEmptySet, fmt::format("surface: none of its {} triangles has an area",
                                                  surface.num_triangles()));
  impl->find_pseudo_normals();
  impl->tree.insert(impl->primitives.cbegin(), impl->primitives.cend());
  // Both are built lazily otherwise, and a lazy build is not thread-safe.
  impl->tree.build();
  impl->tree.accelerate_distance_queries();
  impl->box = impl->tree.bbox();
  return ClosestPointIndex(std::move(impl));
}

ClosestPoint ClosestPointIndex::closest(const Vec3& query) const {
  const auto [point, primitive] = impl_->tree.closest_point_and_primitive(to_cgal(query));
  ClosestPoint result;
  result.point = Vec3(point.x(), point.y(), point.z());
  result.triangle =
      impl_
          ->triangle_of_primitive[static_cast<std::size_t>(primitive - impl_->primitives.cbegin())];
  result.distance_mm = (query - result.point).norm();
  return result;
}

const TriangleSurface& ClosestPointIndex::surface() const { return impl_->surface; }

Vec3 ClosestPointIndex::triangle_normal(int triangle) const {
  return impl_->face_normals.col(triangle);
}

Vec3 ClosestPointIndex::pseudo_normal(const ClosestPoint& closest) const {
  const int t = closest.triangle;
  Vec3 n = impl_->face_normals.col(t);
  // Weight of corner k: area of the triangle that the point makes with the opposite edge.
  Vec3 weights;
  for (int k = 0; k < 3; ++k) {
    const Vec3 a = impl_->vertex(t, (k + 1) % 3);
    const Vec3 b = impl_->vertex(t, (k + 2) % 3);
    weights[k] = n.dot((b - a).cross(closest.point - a));
  }
  weights /= weights.sum();
  for (int k = 0; k < 3; ++k)
    if (weights[k] > 1.0 - kOnEdge)
      return impl_->vertex_normals.col(impl_->surface.triangles(k, t)).normalized();
  for (int k = 0; k < 3; ++k)
    if (weights[k] < kOnEdge) return impl_->edge_normals.col(3 * t + (k + 1) % 3).normalized();
  return n;
}

bool ClosestPointIndex::contains(const Vec3& query) const {
  const auto& box = impl_->box;
  for (int axis = 0; axis < 3; ++axis)
    if (!(query[axis] >= box.min(axis) && query[axis] <= box.max(axis))) return false;
  int votes = 0;
  for (const auto& d : kRayDirections) {
    const TriangleKernel::Ray_3 ray(to_cgal(query), TriangleKernel::Vector_3(d[0], d[1], d[2]));
    votes += impl_->tree.number_of_intersected_primitives(ray) % 2 == 1 ? 1 : 0;
  }
  return votes >= 2;
}

}  // namespace brainshift::geometry
