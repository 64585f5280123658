// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/surface.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "common/core/random.hpp"

namespace brainshift::geometry {
namespace {

using Triangles = Eigen::Matrix<int, 3, Eigen::Dynamic>;

// Faces of a positively oriented tetrahedron, counter-clockwise seen from outside.
constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

// Exponent of Thomsen's formula for the area of an ellipsoid (within 1.1 %).
constexpr double kThomsen = 1.6075;
// 2.6 million vertices: beyond it a typing error in an edge length would fill the memory.
constexpr double kMaxFrequency = 512.0;

struct Face {
  std::array<int, 3> key;  // sorted nodes
  int tet;
  int local;
};

// Twice the triangle's area times its outward unit normal.
Vec3 area_vector(const TriangleSurface& surface, int triangle) {
  const auto t = surface.triangles.col(triangle);
  const Vec3 a = surface.vertices.col(t[0]);
  return (surface.vertices.col(t[1]) - a).cross(surface.vertices.col(t[2]) - a);
}

// Geodesic sphere.
// Each face of an icosahedron is divided into n^2 triangles: 10 n^2 + 2 vertices, 20 n^2
// triangles.

// Vertices (0, +-1, +-g) and cyclic permutations, g the golden ratio.
Points icosahedron_vertices() {
  const double g = (1.0 + std::sqrt(5.0)) / 2.0;
  Points v(3, 12);
  for (int i = 0; i < 4; ++i) {
    const double a = (i & 1) ? 1.0 : -1.0;
    const double b = (i & 2) ? g : -g;
    v.col(i) = Vec3(0.0, a, b);
    v.col(4 + i) = Vec3(a, b, 0.0);
    v.col(8 + i) = Vec3(b, 0.0, a);
  }
  return v;
}

// Its 20 faces: triples of vertices at the edge length 2, turned outwards.
std::vector<std::array<int, 3>> icosahedron_faces(const Points& v) {
  const auto neighbours = [&](int a, int b) {
    return std::abs((v.col(a) - v.col(b)).norm() - 2.0) < 1e-6;
  };
  std::vector<std::array<int, 3>> faces;
  for (int a = 0; a < 12; ++a)
    for (int b = a + 1; b < 12; ++b)
      for (int c = b + 1; c < 12; ++c) {
        if (!neighbours(a, b) || !neighbours(b, c) || !neighbours(a, c)) continue;
        const Vec3 va = v.col(a), vb = v.col(b), vc = v.col(c);
        if (va.dot(vb.cross(vc)) > 0.0)
          faces.push_back({a, b, c});
        else
          faces.push_back({a, c, b});
      }
  return faces;
}

TriangleSurface geodesic_sphere(int n) {
  const Points corners = icosahedron_vertices();
  std::vector<Vec3> vertices;
  // A grid point is the sum of its corners with integer weights that add up to n; written without
  // the zero weights and sorted, this names a point that neighbouring faces share.
  using Name = std::array<std::pair<int, int>, 3>;
  std::map<Name, int> index_of;
  std::vector<std::array<int, 3>> triangles;
  for (const auto& face : icosahedron_faces(corners)) {
    const auto vertex = [&](int i, int j) {  // weights n - i - j, i, j
      Name name{{{face[0], n - i - j}, {face[1], i}, {face[2], j}}};
      for (auto& [corner, weight] : name)
        if (weight == 0) corner = -1;
      std::sort(name.begin(), name.end());
      const auto [entry, is_new] = index_of.try_emplace(name, static_cast<int>(vertices.size()));
      if (is_new) {
        Vec3 x = Vec3::Zero();
        for (const auto& [corner, weight] : name)
          if (weight > 0) x += weight * corners.col(corner);
        vertices.push_back(x.normalized());
      }
      return entry->second;
    };
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)});
        if (i + j + 1 < n)
          triangles.push_back({vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
      }
  }
  TriangleSurface sphere;
  sphere.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i)
    sphere.vertices.col(static_cast<Eigen::Index>(i)) = vertices[i];
  sphere.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (int k = 0; k < 3; ++k)
      sphere.triangles(k, static_cast<Eigen::Index>(i)) = triangles[i][static_cast<std::size_t>(k)];
  return sphere;
}

}  // namespace

Triangles boundary_triangles(const TetMesh& mesh, std::vector<int>* tet_of_triangle) {
  std::vector<Face> faces;
  faces.reserve(4 * static_cast<std::size_t>(mesh.num_tets()));
  for (int t = 0; t < mesh.num_tets(); ++t) {
    for (int f = 0; f < 4; ++f) {
      Face face{
          {mesh.tets(kFaces[f][0], t), mesh.tets(kFaces[f][1], t), mesh.tets(kFaces[f][2], t)},
          t,
          f};
      std::sort(face.key.begin(), face.key.end());
      faces.push_back(face);
    }
  }
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
    return std::tie(a.key, a.tet) < std::tie(b.key, b.tet);
  });
  std::vector<Face> boundary;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t end = i + 1;
    while (end < faces.size() && faces[end].key == faces[i].key) ++end;
    if (end == i + 1) boundary.push_back(faces[i]);
    i = end;
  }
  Triangles triangles(3, static_cast<Eigen::Index>(boundary.size()));
  if (tet_of_triangle) tet_of_triangle->clear();
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    const Face& face = boundary[i];
    for (int k = 0; k < 3; ++k)
      triangles(k, static_cast<Eigen::Index>(i)) = mesh.tets(kFaces[face.local][k], face.tet);
    if (tet_of_triangle) tet_of_triangle->push_back(face.tet);
  }
  return triangles;
}

TriangleSurface boundary_surface(const TetMesh& mesh, std::vector<NodeIndex>* node_of_vertex) {
  return surface_of(mesh.nodes, boundary_triangles(mesh), node_of_vertex);
}

TriangleSurface surface_of(const Points& positions, const Triangles& triangles,
                           std::vector<NodeIndex>* node_of_vertex) {
  TriangleSurface surface;
  surface.triangles = triangles;
  std::vector<NodeIndex> nodes(surface.triangles.data(),
                               surface.triangles.data() + surface.triangles.size());
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  std::vector<int> vertex_of_node(static_cast<std::size_t>(positions.cols()), -1);
  for (std::size_t v = 0; v < nodes.size(); ++v) {
    vertex_of_node[static_cast<std::size_t>(nodes[v])] = static_cast<int>(v);
  }
  surface.vertices = positions(Eigen::all, nodes);
  for (int& index : surface.triangles.reshaped())
    index = vertex_of_node[static_cast<std::size_t>(index)];
  if (node_of_vertex) *node_of_vertex = std::move(nodes);
  return surface;
}

TriangleSurface surface_between(const Points& positions, const Triangles& triangles,
                                std::vector<NodeIndex> nodes) {
  std::sort(nodes.begin(), nodes.end());
  TriangleSurface surface;
  surface.vertices = positions(Eigen::all, nodes);
  const auto vertex_of = [&nodes](NodeIndex node) {
    const auto found = std::lower_bound(nodes.begin(), nodes.end(), node);
    return found != nodes.end() && *found == node ? static_cast<int>(found - nodes.begin()) : -1;
  };
  std::vector<int> corners;
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    const std::array<int, 3> corner = {vertex_of(triangles(0, t)), vertex_of(triangles(1, t)),
                                       vertex_of(triangles(2, t))};
    if (std::min({corner[0], corner[1], corner[2]}) < 0) continue;
    corners.insert(corners.end(), corner.begin(), corner.end());
  }
  surface.triangles =
      Eigen::Map<const Triangles>(corners.data(), 3, static_cast<Eigen::Index>(corners.size() / 3));
  return surface;
}

Points vertex_normals(const TriangleSurface& surface) {
  Points normals = Points::Zero(3, surface.num_vertices());
  for (int t = 0; t < surface.num_triangles(); ++t) {
    const Vec3 n = area_vector(surface, t);
    for (int k = 0; k < 3; ++k) normals.col(surface.triangles(k, t)) += n;
  }
  for (auto normal : normals.colwise()) {
    const double length = normal.norm();
    if (length > 0.0) normal /= length;
  }
  return normals;
}

TriangleSurface offset_surface(const TriangleSurface& surface, double distance_mm) {
  TriangleSurface moved = surface;
  moved.vertices += distance_mm * vertex_normals(surface);
  return moved;
}

double enclosed_volume(const TriangleSurface& surface) {
  if (surface.num_vertices() == 0) return 0.0;
  // About the mean vertex, so that a surface far from the origin loses no digits.
  const Vec3 origin = surface.vertices.rowwise().mean();
  double six_volumes = 0.0;
  for (int t = 0; t < surface.num_triangles(); ++t)
    six_volumes +=
        (surface.vertices.col(surface.triangles(0, t)) - origin).dot(area_vector(surface, t));
  return six_volumes / 6.0;
}

double growth_of_cavity(const TriangleSurface& wall, const Points& displacement) {
  const TriangleSurface moved{wall.vertices + displacement, wall.triangles};
  return enclosed_volume(wall) - enclosed_volume(moved);
}

double area(const TriangleSurface& surface) {
  double twice = 0.0;
  for (int t = 0; t < surface.num_triangles(); ++t) twice += area_vector(surface, t).norm();
  return 0.5 * twice;
}

VecX vertex_areas(const TriangleSurface& surface) {
  VecX areas = VecX::Zero(surface.num_vertices());
  for (int t = 0; t < surface.num_triangles(); ++t) {
    const double third = 0.5 * area_vector(surface, t).norm() / 3.0;
    for (const int vertex : surface.triangles.col(t)) areas[vertex] += third;
  }
  return areas;
}

Vec3 vector_area(const TriangleSurface& surface) {
  Vec3 twice = Vec3::Zero();
  for (int t = 0; t < surface.num_triangles(); ++t) twice += area_vector(surface, t);
  return 0.5 * twice;
}

bool is_closed(const TriangleSurface& surface) {
  std::vector<std::pair<int, int>> edges;
  edges.reserve(3 * static_cast<std::size_t>(surface.num_triangles()));
  for (int t = 0; t < surface.num_triangles(); ++t)
    for (int k = 0; k < 3; ++k)
      edges.emplace_back(surface.triangles(k, t), surface.triangles((k + 1) % 3, t));
  std::sort(edges.begin(), edges.end());
  if (edges.empty() || std::adjacent_find(edges.begin(), edges.end()) != edges.end()) return false;
  return std::all_of(edges.begin(), edges.end(), [&](const std::pair<int, int>& e) {
    return e.first != e.second &&
           std::binary_search(edges.begin(), edges.end(), std::pair(e.second, e.first));
  });
}

int turned_edges(const TriangleSurface& surface) {
  struct Uses {
    int forwards = 0, backwards = 0;
  };
  std::map<std::pair<int, int>, Uses> edges;
  for (int t = 0; t < surface.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = surface.triangles(k, t), b = surface.triangles((k + 1) % 3, t);
      Uses& uses = edges[std::minmax(a, b)];
      ++(a < b ? uses.forwards : uses.backwards);
    }
  }
  return static_cast<int>(std::count_if(edges.begin(), edges.end(), [](const auto& edge) {
    const Uses& uses = edge.second;
    return std::max(uses.forwards, uses.backwards) == 2 &&
           std::min(uses.forwards, uses.backwards) == 0;
  }));
}

MendedSurface mend_surface(const TriangleSurface& surface, double tolerance_mm) {
  const int count = surface.num_vertices();
  std::vector<int> order(static_cast<std::size_t>(count)), meant(order.size());
  std::iota(order.begin(), order.end(), 0);
  std::iota(meant.begin(), meant.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return std::pair(surface.vertices(0, a), a) < std::pair(surface.vertices(0, b), b);
  });
  MendedSurface mended;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Vec3 x = surface.vertices.col(order[i]);
    for (std::size_t k = i; k-- > 0;) {
      const int other = order[k];
      if (x[0] - surface.vertices(0, other) > tolerance_mm) break;
      if ((x - surface.vertices.col(other)).norm() > tolerance_mm) continue;
      meant[static_cast<std::size_t>(order[i])] = meant[static_cast<std::size_t>(other)];
      ++mended.merged_vertices;
      break;
    }
  }
  std::set<std::array<int, 3>> seen;  // the lowest vertex first
  std::vector<int> corners, new_index(order.size(), -1);
  for (int t = 0; t < surface.num_triangles(); ++t) {
    std::array<int, 3> corner{};
    for (std::size_t k = 0; k < 3; ++k) {
      corner[k] = meant[static_cast<std::size_t>(surface.triangles(static_cast<int>(k), t))];
    }
    if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) continue;
    std::rotate(corner.begin(), std::min_element(corner.begin(), corner.end()), corner.end());
    if (!seen.insert(corner).second) {
      ++mended.repeated_triangles;
      continue;
    }
    corners.insert(corners.end(), corner.begin(), corner.end());
    for (const int v : corner) new_index[static_cast<std::size_t>(v)] = 0;
  }
  mended.surface.vertices.resize(3, count);
  int next = 0;
  for (int v = 0; v < count; ++v) {
    int& index = new_index[static_cast<std::size_t>(v)];
    if (index < 0) continue;
    mended.surface.vertices.col(index = next++) = surface.vertices.col(v);
  }
  mended.surface.vertices.conservativeResize(Eigen::NoChange, next);
  for (int& v : corners) v = new_index[static_cast<std::size_t>(v)];
  mended.surface.triangles =
      Eigen::Map<const Triangles>(corners.data(), 3, static_cast<Eigen::Index>(corners.size() / 3));
  return mended;
}

TriangleSurface ellipsoid_surface(const Vec3& centre, const Vec3& semi_axes_mm, double edge_mm) {
  assert(semi_axes_mm.minCoeff() > 0.0 && edge_mm > 0.0);
  // 20 n^2 near-equilateral triangles share the area.
  const Eigen::Array3d powers = semi_axes_mm.array().pow(kThomsen);
  const double mean = (powers[0] * powers[1] + powers[1] * powers[2] + powers[2] * powers[0]) / 3.0;
  const double ellipsoid_area = 4.0 * std::numbers::pi * std::pow(mean, 1.0 / kThomsen);
  const double triangle_area = std::sqrt(3.0) / 4.0 * edge_mm * edge_mm;
  const double frequency = std::sqrt(ellipsoid_area / (20.0 * triangle_area));
  const int n = static_cast<int>(std::clamp(std::round(frequency), 1.0, kMaxFrequency));
  TriangleSurface surface = geodesic_sphere(n);
  surface.vertices = (semi_axes_mm.asDiagonal() * surface.vertices).colwise() + centre;
  return surface;
}

Points sample_surface(const TriangleSurface& surface, int count, std::uint64_t seed) {
  assert(surface.num_triangles() > 0 && count >= 0);
  std::vector<double> cumulative;
  cumulative.reserve(static_cast<std::size_t>(surface.num_triangles()));
  double total = 0.0;
  for (int t = 0; t < surface.num_triangles(); ++t)
    cumulative.push_back(total += area_vector(surface, t).norm());
  Random random(seed);
  Points points(3, count);
  for (int i = 0; i < count; ++i) {
    const double target = random.uniform() * total;
    const auto found = std::upper_bound(cumulative.begin(), cumulative.end() - 1, target);
    const auto t = surface.triangles.col(found - cumulative.begin());
    // Uniform in a triangle: sqrt turns a uniform number into one whose density grows from the
    // apex.
    const double s = std::sqrt(random.uniform());
    const double r = random.uniform();
    points.col(i) = (1.0 - s) * surface.vertices.col(t[0]) +
                    s * (1.0 - r) * surface.vertices.col(t[1]) + s * r * surface.vertices.col(t[2]);
  }
  return points;
}

Points plane_section(const TriangleSurface& surface, const Vec3& normal, double offset) {
  // A vertex on the plane counts as above it: then each triangle is crossed through two edges or
  // none.
  const VecX height = (surface.vertices.transpose() * normal).array() - offset;
  const auto crossing = [&](int a, int b) -> Vec3 {
    if (a > b) std::swap(a, b);  // both triangles of an edge compute the same point, bit for bit
    const double w = height[a] / (height[a] - height[b]);
    return (1.0 - w) * surface.vertices.col(a) + w * surface.vertices.col(b);
  };
  std::vector<Vec3> ends;
  for (int t = 0; t < surface.num_triangles(); ++t) {
    Vec3 hit[2];
    int hits = 0;
    for (int k = 0; k < 3; ++k) {
      const int a = surface.triangles(k, t);
      const int b = surface.triangles((k + 1) % 3, t);
      if ((height[a] >= 0.0) != (height[b] >= 0.0) && hits < 2) hit[hits++] = crossing(a, b);
    }
    if (hits == 2 && hit[0] != hit[1]) ends.insert(ends.end(), {hit[0], hit[1]});
  }
  Points segments(3, static_cast<Eigen::Index>(ends.size()));
  for (std::size_t i = 0; i < ends.size(); ++i)
    segments.col(static_cast<Eigen::Index>(i)) = ends[i];
  return segments;
}

}  // namespace brainshift::geometry
