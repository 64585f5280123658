// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/moving_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "common/geometry/surface.hpp"

namespace brainshift::geometry {
namespace {

// A weight below this lies on the opposite edge.
constexpr double kOnRim = 1e-9;
// Twice the area over the longest edge squared; a flatter triangle has no plane.
constexpr double kFlatTriangle = 1e-12;

}  // namespace

MovingSurface::MovingSurface(ClosestPointIndex at_rest) : at_rest_(std::move(at_rest)) {
  const TriangleSurface& surface = at_rest_.surface();
  const auto corner = [&](int t, int k) { return surface.triangles(k % 3, t); };
  const auto edge = [&](int t, int k) {
    return std::pair<int, int>(std::minmax({corner(t, k), corner(t, k + 1)}));
  };
  first_.assign(static_cast<std::size_t>(surface.num_vertices()) + 1, 0);
  std::map<std::pair<int, int>, int> uses;
  for (int t = 0; t < surface.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      ++first_[static_cast<std::size_t>(corner(t, k)) + 1];
      ++uses[edge(t, k)];
    }
  }
  for (std::size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
  around_.resize(static_cast<std::size_t>(first_.back()));
  std::vector<int> next(first_.begin(), first_.end() - 1);
  rim_vertex_.assign(static_cast<std::size_t>(surface.num_vertices()), 0);
  for (int t = 0; t < surface.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      around_[static_cast<std::size_t>(next[static_cast<std::size_t>(corner(t, k))]++)] = t;
      const bool rim = uses[edge(t, k)] == 1;
      rim_edge_.push_back(rim ? 1 : 0);
      if (!rim) continue;
      rim_vertex_[static_cast<std::size_t>(corner(t, k))] = 1;
      rim_vertex_[static_cast<std::size_t>(corner(t, k + 1))] = 1;
    }
  }
}

Result<MovingSurface> MovingSurface::build(const TriangleSurface& at_rest) {
  auto index = ClosestPointIndex::build(at_rest);
  if (!index) return tl::unexpected(index.error());
  return MovingSurface(std::move(*index));
}

MovedSurface::MovedSurface(const MovingSurface& surface, Points vertices)
    : surface_(surface),
      moved_{std::move(vertices), surface.at_rest_.surface().triangles},
      normals_(vertex_normals(moved_)),
      mean_motion_((moved_.vertices - surface.at_rest_.surface().vertices).rowwise().mean()) {}

SurfacePlace MovedSurface::closest_on(int triangle, const Vec3& query) const {
  const auto corners = moved_.triangles.col(triangle);
  const TriangleFrame frame(moved_.vertices.col(corners[0]), moved_.vertices.col(corners[1]),
                            moved_.vertices.col(corners[2]));
  SurfacePlace place;
  place.triangle = triangle;
  place.distance_mm = std::numeric_limits<double>::infinity();
  const double longest = std::max({frame.ab_ab, frame.ac_ac, (frame.ac - frame.ab).squaredNorm()});
  if (!(std::sqrt(std::max(0.0, frame.determinant)) > kFlatTriangle * longest)) return place;
  const Vec3 q = closest_on_triangle(frame, query);
  const double along_ab = frame.ab.dot(q - frame.a), along_ac = frame.ac.dot(q - frame.a);
  const double b = (frame.ac_ac * along_ab - frame.ab_ac * along_ac) / frame.determinant;
  const double c = (frame.ab_ab * along_ac - frame.ab_ac * along_ab) / frame.determinant;
  place.weights = Vec3(1.0 - b - c, b, c);
  place.distance_mm = (query - q).norm();
  return place;
}

SurfacePlace MovedSurface::closest(const Vec3& query) const {
  SurfacePlace best = closest_on(surface_.at_rest_.closest(query - mean_motion_).triangle, query);
  for (int before = -1; best.triangle != before;) {
    before = best.triangle;
    for (const int vertex : moved_.triangles.col(before)) {
      const auto v = static_cast<std::size_t>(vertex);
      for (int i = surface_.first_[v]; i < surface_.first_[v + 1]; ++i) {
        const SurfacePlace other = closest_on(surface_.around_[static_cast<std::size_t>(i)], query);
        if (other.distance_mm < best.distance_mm) best = other;
      }
    }
  }
  return best;
}

Vec3 MovedSurface::interpolated(const SurfacePlace& place, const Points& values) const {
  const auto corners = moved_.triangles.col(place.triangle);
  return place.weights[0] * values.col(corners[0]) + place.weights[1] * values.col(corners[1]) +
         place.weights[2] * values.col(corners[2]);
}

Vec3 MovedSurface::point_at_rest(const SurfacePlace& place) const {
  return interpolated(place, surface_.at_rest_.surface().vertices);
}

Vec3 MovedSurface::normal(const SurfacePlace& place) const {
  return interpolated(place, normals_).normalized();
}

bool MovedSurface::on_rim(const SurfacePlace& place) const {
  for (int k = 0; k < 3; ++k) {
    const std::size_t edge =
        3 * static_cast<std::size_t>(place.triangle) + static_cast<std::size_t>(k);
    const auto corner = static_cast<std::size_t>(moved_.triangles(k, place.triangle));
    // Edge k lies opposite to corner k + 2.
    if (surface_.rim_edge_[edge] != 0 && place.weights[(k + 2) % 3] < kOnRim) return true;
    if (surface_.rim_vertex_[corner] != 0 && place.weights[k] > 1.0 - kOnRim) return true;
  }
  return false;
}

}  // namespace brainshift::geometry
