// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/mesh_quality.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>

namespace brainshift::geometry {

double tet_volume(const TetMesh& mesh, int tet) {
  const auto nodes = mesh.tets.col(tet);
  const Vec3 x0 = mesh.nodes.col(nodes[0]);
  const Vec3 a = mesh.nodes.col(nodes[1]) - x0;
  const Vec3 b = mesh.nodes.col(nodes[2]) - x0;
  const Vec3 c = mesh.nodes.col(nodes[3]) - x0;
  return a.cross(b).dot(c) / 6.0;
}

std::vector<MeshFace> sorted_faces(const Eigen::Matrix<int, 4, Eigen::Dynamic>& tets) {
  std::vector<MeshFace> faces;
  faces.reserve(4 * static_cast<std::size_t>(tets.cols()));
  for (int t = 0; t < static_cast<int>(tets.cols()); ++t)
    for (int omit = 0; omit < 4; ++omit) {
      MeshFace face{{tets((omit + 1) % 4, t), tets((omit + 2) % 4, t), tets((omit + 3) % 4, t)}, t};
      std::sort(face.nodes.begin(), face.nodes.end());
      faces.push_back(face);
    }
  std::sort(faces.begin(), faces.end(),
            [](const MeshFace& a, const MeshFace& b) { return a.nodes < b.nodes; });
  return faces;
}

namespace {

constexpr std::array<std::array<int, 2>, 6> kEdges = {
    {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

double longest_edge(const TetMesh& mesh, int tet) {
  double longest = 0.0;
  for (const auto& [a, b] : kEdges)
    longest = std::max(
        longest, (mesh.nodes.col(mesh.tets(a, tet)) - mesh.nodes.col(mesh.tets(b, tet))).norm());
  return longest;
}

Status check_nodes(const TetMesh& mesh) {
  for (int n = 0; n < mesh.num_nodes(); ++n)
    if (!mesh.nodes.col(n).allFinite())
      return fail(ErrorCode::kNotFinite,
                  fmt::format("mesh node {}: position ({}, {}, {}) is not finite", n,
                              mesh.nodes(0, n), mesh.nodes(1, n), mesh.nodes(2, n)));
  return {};
}

Status check_indices(const TetMesh& mesh) {
  for (int t = 0; t < mesh.num_tets(); ++t)
    for (int a = 0; a < 4; ++a)
      if (mesh.tets(a, t) < 0 || mesh.tets(a, t) >= mesh.num_nodes())
        return invalid(fmt::format("mesh tetrahedron {}: node index {} must be between 0 and {}", t,
                                   mesh.tets(a, t), mesh.num_nodes() - 1));
  if (!mesh.labels.empty() && mesh.labels.size() != static_cast<std::size_t>(mesh.num_tets()))
    return invalid(fmt::format("mesh labels: {} labels for {} tetrahedra", mesh.labels.size(),
                               mesh.num_tets()));
  return {};
}

Status check_volumes(const TetMesh& mesh) {
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const double volume = tet_volume(mesh, t);
    const double edge = longest_edge(mesh, t);
    const double least = 1e-9 * edge * edge * edge;
    if (volume < -least)
      return fail(ErrorCode::kDegenerateMesh,
                  fmt::format("mesh tetrahedron {} is inverted: volume {:.6g} mm^3", t, volume));
    if (!(volume >= least && volume > 0.0))
      return fail(
          ErrorCode::kDegenerateMesh,
          fmt::format("mesh tetrahedron {} is flat: volume {:.6g} mm^3, longest edge {:.6g} mm", t,
                      volume, edge));
  }
  return {};
}

// Tetrahedra that overlap count their tissue twice. Two on one side of a face overlap; a
// tetrahedron that is there twice has this on all of its faces.
Status check_overlap(const TetMesh& mesh) {
  const std::vector<MeshFace> faces = sorted_faces(mesh.tets);
  const auto side = [&mesh](const MeshFace& face) {
    const auto nodes = mesh.tets.col(face.tet);
    Vec3 centre = Vec3::Zero();
    for (const int n : nodes) centre += 0.25 * mesh.nodes.col(n);
    const Vec3 a = mesh.nodes.col(face.nodes[0]), b = mesh.nodes.col(face.nodes[1]),
               c = mesh.nodes.col(face.nodes[2]);
    return (b - a).cross(c - a).dot(centre - a) > 0.0;
  };
  int count = 0;
  std::string first;
  for (std::size_t i = 0; i + 1 < faces.size(); ++i) {
    for (std::size_t k = i + 1; k < faces.size() && faces[k].nodes == faces[i].nodes; ++k) {
      if (side(faces[i]) != side(faces[k])) continue;
      if (count++ > 0) continue;
      const bool same = std::is_permutation(mesh.tets.col(faces[i].tet).begin(),
                                            mesh.tets.col(faces[i].tet).end(),
                                            mesh.tets.col(faces[k].tet).begin());
      first = fmt::format("tetrahedra {} and {} {}", std::min(faces[i].tet, faces[k].tet),
                          std::max(faces[i].tet, faces[k].tet),
                          same ? "have the same four nodes" : "overlap");
    }
  }
  if (count == 0) return {};
  return fail(ErrorCode::kDegenerateMesh,
              fmt::format("mesh {}: tissue would count twice ({} faces have two on one side)",
                          first, count));
}

Status check_connected(const TetMesh& mesh) {
  std::vector<char> used(static_cast<std::size_t>(mesh.num_nodes()), 0);
  for (int t = 0; t < mesh.num_tets(); ++t)
    for (int a = 0; a < 4; ++a) used[static_cast<std::size_t>(mesh.tets(a, t))] = 1;
  const auto unused = std::count(used.begin(), used.end(), 0);
  if (unused > 0)
    return fail(ErrorCode::kDegenerateMesh,
                fmt::format("mesh has {} unused nodes, the first is node {}", unused,
                            std::find(used.begin(), used.end(), 0) - used.begin()));
  const TetComponents components = tet_components(mesh.tets);
  if (components.sizes.size() > 1)
    return fail(ErrorCode::kDegenerateMesh,
                fmt::format("mesh has {} components not joined by faces, the smallest has {} of {} "
                            "tetrahedra",
                            components.sizes.size(),
                            *std::min_element(components.sizes.begin(), components.sizes.end()),
                            mesh.num_tets()));
  return {};
}

}  // namespace

TetComponents tet_components(const Eigen::Matrix<int, 4, Eigen::Dynamic>& tets,
                             const std::vector<std::array<int, 3>>& walls) {
  std::vector<int> parent(static_cast<std::size_t>(tets.cols()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&parent](int t) {
    while (parent[static_cast<std::size_t>(t)] != t) {
      auto& up = parent[static_cast<std::size_t>(t)];
      up = parent[static_cast<std::size_t>(up)];
      t = up;
    }
    return t;
  };
  const std::vector<MeshFace> faces = sorted_faces(tets);
  for (std::size_t f = 1; f < faces.size(); ++f) {
    if (faces[f].nodes != faces[f - 1].nodes) continue;
    if (std::binary_search(walls.begin(), walls.end(), faces[f].nodes)) continue;
    const int a = root(faces[f].tet);
    const int b = root(faces[f - 1].tet);
    parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
  }
  TetComponents result;
  result.component_of_tet.resize(parent.size());
  for (int t = 0; t < static_cast<int>(parent.size()); ++t) {
    const int lowest = root(t);
    int& component = result.component_of_tet[static_cast<std::size_t>(t)];
    if (lowest == t) {  // roots come before the rest of their component
      component = static_cast<int>(result.sizes.size());
      result.sizes.push_back(0);
    } else {
      component = result.component_of_tet[static_cast<std::size_t>(lowest)];
    }
    ++result.sizes[static_cast<std::size_t>(component)];
  }
  return result;
}

Status check_mesh(const TetMesh& mesh) {
  if (mesh.num_tets() == 0) return fail(ErrorCode::kEmptySet, "mesh has no tetrahedron");
  for (const auto check :
       {check_nodes, check_indices, check_volumes, check_overlap, check_connected})
    if (Status status = check(mesh); !status) return status;
  return {};
}

}  // namespace brainshift::geometry
