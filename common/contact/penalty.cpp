// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/contact/penalty.hpp"

#include <fmt/format.h>
#include <nanoflann.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "common/core/point_columns.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::contact {
namespace {

using Edge = std::pair<int, int>;

// Area over the squared longest edge below which a master triangle has no usable normal.
constexpr double kFlat = 1e-10;
// Two normals that cancel to less than this leave no direction (a folded edge, a spike).
constexpr double kCancelled = 1e-6;
// A projection this little beyond a border, relative to the triangle, still falls within it.
constexpr double kWithin = 1e-12;

using KdTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointColumns>,
                                        PointColumns, 3, std::size_t>;

struct Projection {
  Vec3 point = Vec3::Zero();
  Vec3 outward = Vec3::Zero();  // of the skull with respect to the brain
  double squared_distance = std::numeric_limits<double>::infinity();
};

class MasterSurface {
 public:
  static Result<MasterSurface> build(const TriangleSurface& skull);

  const std::vector<int>& triangles_at(int vertex) const {
    return triangles_at_[static_cast<std::size_t>(vertex)];
  }
  // Vertices that carry a triangle, in increasing order.
  std::vector<int> used_vertices() const;
  Vec3 face_normal(int triangle) const { return face_normals_.col(triangle); }
  Projection on_face(int triangle, const Vec3& slave) const;
  Projection on_edge(const Edge& edge, const Vec3& slave) const;
  Projection on_vertex(int vertex, const Vec3& slave) const;
  Edge edge(int triangle, int k) const {
    return std::minmax(skull_->triangles(k, triangle), skull_->triangles((k + 1) % 3, triangle));
  }

 private:
  Vec3 vertex(int v) const { return skull_->vertices.col(v); }

  const TriangleSurface* skull_ = nullptr;
  Points face_normals_, vertex_normals_;
  std::map<Edge, Vec3> edge_normals_;
  std::vector<std::vector<int>> triangles_at_;
};

Result<MasterSurface> MasterSurface::build(const TriangleSurface& skull) {
  if (skull.num_triangles() == 0) return fail(ErrorCode::kEmptySet, "skull: no triangle");
  MasterSurface master;
  master.skull_ = &skull;
  master.face_normals_.resize(3, skull.num_triangles());
  master.triangles_at_.resize(static_cast<std::size_t>(skull.num_vertices()));
  for (int t = 0; t < skull.num_triangles(); ++t) {
    const auto corners = skull.triangles.col(t);
    if (corners.minCoeff() < 0 || corners.maxCoeff() >= skull.num_vertices())
      return invalid(fmt::format("skull: triangle {} names a vertex outside 0..{}", t,
                                 skull.num_vertices() - 1));
    const Vec3 a = skull.vertices.col(corners[0]);
    const Vec3 b = skull.vertices.col(corners[1]);
    const Vec3 c = skull.vertices.col(corners[2]);
    const Vec3 n = (b - a).cross(c - a);
    const double longest =
        std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    if (!n.allFinite())
      return fail(ErrorCode::kNotFinite, fmt::format("skull: triangle {} is not finite", t));
    if (!(0.5 * n.norm() > kFlat * longest))
      return fail(
          ErrorCode::kDegenerateMesh,
          fmt::format("skull: triangle {} has an area of {:.3g} mm^2 over edges of {:.3g} mm", t,
                      0.5 * n.norm(), std::sqrt(longest)));
    master.face_normals_.col(t) = n.normalized();
    for (int k = 0; k < 3; ++k) {
      master.triangles_at_[static_cast<std::size_t>(corners[k])].push_back(t);
      master.edge_normals_.try_emplace(master.edge(t, k), Vec3::Zero()).first->second +=
          n.normalized();
    }
  }
  master.vertex_normals_ = geometry::vertex_normals(skull);
  return master;
}

std::vector<int> MasterSurface::used_vertices() const {
  std::vector<int> used;
  for (std::size_t v = 0; v < triangles_at_.size(); ++v)
    if (!triangles_at_[v].empty()) used.push_back(static_cast<int>(v));
  return used;
}

// Orthogonal projection onto the plane; infinitely far when it falls beyond the triangle's
// border.
Projection MasterSurface::on_face(int triangle, const Vec3& slave) const {
  const Vec3 n = face_normals_.col(triangle);
  const auto corners = skull_->triangles.col(triangle);
  const double height = n.dot(slave - vertex(corners[0]));
  Projection projection{slave - height * n, n, height * height};
  for (int k = 0; k < 3; ++k) {
    const Vec3 a = vertex(corners[k]);
    const Vec3 along = vertex(corners[(k + 1) % 3]) - a;
    const double side = n.dot(along.cross(projection.point - a));
    if (side < -kWithin * along.squaredNorm()) return {};
  }
  return projection;
}

// Orthogonal projection onto the line; infinitely far when it falls beyond the ends.
Projection MasterSurface::on_edge(const Edge& edge, const Vec3& slave) const {
  const Vec3 a = vertex(edge.first);
  const Vec3 along = vertex(edge.second) - a;
  const double s = along.dot(slave - a) / along.squaredNorm();
  if (s < 0.0 || s > 1.0) return {};
  const Vec3 point = a + s * along;
  return {point, edge_normals_.at(edge), (slave - point).squaredNorm()};
}

Projection MasterSurface::on_vertex(int v, const Vec3& slave) const {
  return {vertex(v), vertex_normals_.col(v), (slave - vertex(v)).squaredNorm()};
}

// Steps 2 and 3 for the slave whose closest master node is `closest_vertex`.
Projection project(const MasterSurface& master, int closest_vertex, const Vec3& slave) {
  const std::vector<int>& triangles = master.triangles_at(closest_vertex);
  const auto nearer = [](const Projection& a, const Projection& b) {
    return a.squared_distance < b.squared_distance;
  };
  Projection best;
  int nearest_triangle = triangles.front();
  for (const int t : triangles)
    if (const Projection face = master.on_face(t, slave); nearer(face, best)) {
      best = face;
      nearest_triangle = t;
    }
  if (!(best.squared_distance < std::numeric_limits<double>::infinity())) {
    for (const int t : triangles)
      for (int k = 0; k < 3; ++k)
        if (const Projection edge = master.on_edge(master.edge(t, k), slave); nearer(edge, best)) {
          best = edge;
          nearest_triangle = t;
        }
    // The closest node can be nearer than every edge that holds a projection.
    if (const Projection node = master.on_vertex(closest_vertex, slave); nearer(node, best))
      best = node;
  }
  const double length = best.outward.norm();
  best.outward =
      length > kCancelled ? Vec3(best.outward / length) : master.face_normal(nearest_triangle);
  return best;
}

}  // namespace

Result<std::vector<ContactPair>> search_contact(const Points& nodes,
                                                const std::vector<NodeIndex>& slaves,
                                                const TriangleSurface& skull) {
  auto master = MasterSurface::build(skull);
  if (!master) return tl::unexpected(master.error());
  const std::vector<int> used = master->used_vertices();
  const Points master_nodes = skull.vertices(Eigen::all, used);
  const PointColumns cloud{master_nodes};
  const KdTree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(8));

  std::vector<ContactPair> pairs;
  pairs.reserve(slaves.size());
  for (const NodeIndex slave : slaves) {
    if (slave < 0 || slave >= nodes.cols())
      return invalid(fmt::format("slaves: node {} is outside 0..{}", slave, nodes.cols() - 1));
    const Vec3 s = nodes.col(slave);
    if (!s.allFinite())
      return fail(ErrorCode::kNotFinite, fmt::format("slaves: node {} is not finite", slave));
    std::size_t closest = 0;
    double squared_distance = 0.0;
    tree.knnSearch(s.data(), 1, &closest, &squared_distance);
    const Projection y = project(*master, used[closest], s);
    const Vec3 normal = -y.outward;
    pairs.push_back({slave, y.point, normal, (y.point - s).dot(normal)});
  }
  return pairs;
}

PenaltyContact::PenaltyContact(std::vector<ContactPair> pairs, double beta)
    : pairs_(std::move(pairs)), beta_(beta) {
  assert(beta_ > 0.0);
}

VecX PenaltyContact::penetration(const Points& u) const {
  VecX p(num_slaves());
  for (int i = 0; i < num_slaves(); ++i) {
    p[i] = pairs_[i].initial_penetration_mm - pairs_[i].normal.dot(u.col(pairs_[i].slave));
  }
  return p;
}

ActiveSet PenaltyContact::penetrating(const Points& u) const {
  const VecX p = penetration(u);
  ActiveSet active(pairs_.size());
  for (int i = 0; i < num_slaves(); ++i) active[i] = p[i] > 0.0;
  return active;
}

void PenaltyContact::add_stiffness(linalg::SymmetricMatrix& lower, const fem::DofMap& dofs,
                                   const ActiveSet& active) const {
  assert(active.size() == pairs_.size());
  for (int i = 0; i < num_slaves(); ++i) {
    if (!active[i]) continue;
    const Vec3& normal = pairs_[i].normal;
    fem::add_to_node_block(lower, dofs, pairs_[i].slave, beta_ * normal * normal.transpose());
  }
}

void PenaltyContact::add_load(Points& b, const ActiveSet& active) const {
  assert(active.size() == pairs_.size());
  for (int i = 0; i < num_slaves(); ++i) {
    if (!active[i]) continue;
    b.col(pairs_[i].slave) += beta_ * pairs_[i].initial_penetration_mm * pairs_[i].normal;
  }
}

int count(const ActiveSet& active) {
  return static_cast<int>(
      std::count_if(active.begin(), active.end(), [](char a) { return a != 0; }));
}

}  // namespace brainshift::contact
