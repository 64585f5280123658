// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/slit_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::geometry {
namespace {

using Facet = std::array<int, 3>;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

bool face_before(const MeshFace& a, const MeshFace& b) { return a.nodes < b.nodes; }

// Disjoint sets.
class Unions {
 public:
  explicit Unions(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  // The lower root stays.
  void join(std::size_t a, std::size_t b) {
    const std::size_t first = root(a), second = root(b);
    parent_[std::max(first, second)] = std::min(first, second);
  }

 private:
  std::vector<std::size_t> parent_;
};

Vec3 facet_area(const Points& nodes, const Facet& f) {
  const Vec3 a = nodes.col(f[0]), b = nodes.col(f[1]), c = nodes.col(f[2]);
  return 0.5 * (b - a).cross(c - a);
}

// The groups of the tetrahedra about one node that faces which are no facets of a slit join; for
// each of them the number of its group, 0 the one with the lowest tetrahedron.
std::vector<int> groups_about(const TetMesh& mesh, int node, const std::vector<int>& tets,
                              const Facets& slit) {
  std::vector<MeshFace> faces;
  for (std::size_t i = 0; i < tets.size(); ++i) {
    for (int omit = 0; omit < 4; ++omit) {
      if (mesh.tets(omit, tets[i]) == node) continue;
      Facet nodes{};
      std::size_t filled = 0;
      for (int k = 0; k < 4; ++k)
        if (k != omit) nodes[filled++] = mesh.tets(k, tets[i]);
      std::sort(nodes.begin(), nodes.end());
      faces.push_back({nodes, static_cast<int>(i)});
    }
  }
  std::sort(faces.begin(), faces.end(), face_before);
  Unions unions(tets.size());
  for (std::size_t f = 0; f + 1 < faces.size(); ++f) {
    if (faces[f].nodes != faces[f + 1].nodes) continue;
    if (!std::binary_search(slit.begin(), slit.end(), faces[f].nodes)) {
      unions.join(at(faces[f].tet), at(faces[f + 1].tet));
    }
  }
  std::map<std::size_t, int> number;
  std::vector<int> groups;
  for (std::size_t i = 0; i < tets.size(); ++i) {
    groups.push_back(
        number.try_emplace(unions.root(i), static_cast<int>(number.size())).first->second);
  }
  return groups;
}

// Of a tetrahedron's three nodes, what they have become.
Facet renamed(const TetMesh& old, const TetMesh& cut, int tet, const Facet& nodes) {
  Facet result{};
  for (std::size_t n = 0; n < 3; ++n)
    for (int k = 0; k < 4; ++k)
      if (old.tets(k, tet) == nodes[n]) result[n] = cut.tets(k, tet);
  return result;
}

Eigen::Matrix3Xi triangles_of(const std::vector<Facet>& list) {
  Eigen::Matrix3Xi triangles(3, static_cast<Eigen::Index>(list.size()));
  for (std::size_t i = 0; i < list.size(); ++i) {
    triangles.col(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::Vector3i>(list[i].data());
  }
  return triangles;
}

// The facet turned so that its normal looks away from a tetrahedron that has it.
Facet turned_out(const TetMesh& mesh, int tet, Facet facet) {
  Vec3 centre = Vec3::Zero();
  for (int k = 0; k < 4; ++k) centre += 0.25 * mesh.nodes.col(mesh.tets(k, tet));
  if (facet_area(mesh.nodes, facet).dot(centre - mesh.nodes.col(facet[0])) > 0.0) {
    std::swap(facet[1], facet[2]);
  }
  return facet;
}

}  // namespace

SlitMesh cut_mesh(const TetMesh& mesh, const std::vector<char>& taken, const Facets& facets,
                  const std::vector<int>& group_of) {
  SlitMesh result;
  std::vector<int> outer_tets;
  const Eigen::Matrix3Xi outer = boundary_triangles(mesh, &outer_tets);

  // Tetrahedra that stay: the largest part of those that are not taken.
  std::vector<int> kept;
  for (int t = 0; t < mesh.num_tets(); ++t)
    if (!taken[at(t)]) kept.push_back(t);
  const TetComponents parts = tet_components(mesh.tets(Eigen::all, kept));
  const auto largest = static_cast<int>(std::max_element(parts.sizes.begin(), parts.sizes.end()) -
                                        parts.sizes.begin());
  std::vector<char> stays(at(mesh.num_tets()), 0);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    stays[at(kept[i])] = parts.component_of_tet[i] == largest;
  }

  Facets slit = facets;
  std::sort(slit.begin(), slit.end());
  std::vector<char> on_slit(at(mesh.num_nodes()), 0);
  for (const Facet& facet : slit)
    for (const int n : facet) on_slit[at(n)] = 1;
  std::vector<std::vector<int>> about(at(mesh.num_nodes()));
  std::vector<char> used(at(mesh.num_nodes()), 0);
  for (int t = 0; t < mesh.num_tets(); ++t) {
    if (!stays[at(t)]) continue;
    for (const int n : mesh.tets.col(t)) {
      used[at(n)] = 1;
      if (on_slit[at(n)]) about[at(n)].push_back(t);
    }
  }
  result.copies.resize(at(mesh.num_nodes()));
  std::vector<int> old_of;
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    if (!used[at(n)]) continue;
    result.copies[at(n)].push_back(static_cast<int>(old_of.size()));
    old_of.push_back(n);
  }
  TetMesh cut = mesh;  // its tetrahedra in the old order, with the new numbers
  for (int t = 0; t < mesh.num_tets(); ++t)
    for (int& n : cut.tets.col(t)) n = used[at(n)] ? result.copies[at(n)].front() : -1;
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    if (about[at(n)].empty()) continue;
    const std::vector<int> groups = groups_about(mesh, n, about[at(n)], slit);
    for (std::size_t i = 0; i < groups.size(); ++i) {
      auto& copies = result.copies[at(n)];
      if (groups[i] == static_cast<int>(copies.size())) {
        copies.push_back(static_cast<int>(old_of.size()));
        old_of.push_back(n);
      }
      for (int k = 0; k < 4; ++k)
        if (mesh.tets(k, about[at(n)][i]) == n)
          cut.tets(k, about[at(n)][i]) = copies[at(groups[i])];
    }
  }
  cut.nodes = mesh.nodes(Eigen::all, old_of);

  std::vector<Facet> surface, wall, sheets;
  for (Eigen::Index f = 0; f < outer.cols(); ++f) {
    const int tet = outer_tets[static_cast<std::size_t>(f)];
    if (!stays[at(tet)]) continue;
    surface.push_back(renamed(mesh, cut, tet, {outer(0, f), outer(1, f), outer(2, f)}));
  }
  // Per group and node of a side, the sum of the areas that look into its tissue.
  std::map<std::pair<int, NodeIndex>, Vec3> into;
  const std::vector<MeshFace> faces = sorted_faces(mesh.tets);
  for (std::size_t f = 0; f + 1 < faces.size(); ++f) {
    if (faces[f].nodes != faces[f + 1].nodes) continue;
    const std::array<int, 2> sides = {faces[f].tet, faces[f + 1].tet};
    const bool first = stays[at(sides[0])] != 0, second = stays[at(sides[1])] != 0;
    if (first != second) {
      const int tet = first ? sides[0] : sides[1];
      wall.push_back(turned_out(cut, tet, renamed(mesh, cut, tet, faces[f].nodes)));
    }
    if (!first || !second) continue;
    const auto found = std::lower_bound(slit.begin(), slit.end(), faces[f].nodes);
    if (found == slit.end() || *found != faces[f].nodes) continue;
    const auto given = std::find(facets.begin(), facets.end(), *found) - facets.begin();
    const Facet one = renamed(mesh, cut, sides[0], faces[f].nodes);
    const Facet other = renamed(mesh, cut, sides[1], faces[f].nodes);
    if (one == other) continue;
    for (const int tet : sides) {
      const Facet& mine = tet == sides[0] ? one : other;
      sheets.push_back(turned_out(cut, tet, mine));
      for (std::size_t k = 0; k < 3; ++k) {
        if (one[k] == other[k]) continue;
        into.try_emplace({group_of[static_cast<std::size_t>(given)], mine[k]}, Vec3::Zero())
            .first->second -= facet_area(cut.nodes, sheets.back());
      }
    }
  }
  result.outer = triangles_of(surface);
  result.wall = triangles_of(wall);
  result.sheets = triangles_of(sheets);
  std::vector<Vec3> normals;
  for (const auto& [key, area] : into) {
    if (!(area.norm() > 0.0)) continue;
    result.side_nodes.push_back(key.second);
    normals.push_back(area.normalized());
  }
  result.side_normals = columns_of(normals);

  std::vector<int> order;
  for (int t = 0; t < mesh.num_tets(); ++t)
    if (stays[at(t)]) order.push_back(t);
  result.mesh.nodes = std::move(cut.nodes);
  result.mesh.tets = cut.tets(Eigen::all, order);
  if (!mesh.labels.empty())
    for (const int t : order) result.mesh.labels.push_back(mesh.labels[at(t)]);
  return result;
}

}  // namespace brainshift::geometry
