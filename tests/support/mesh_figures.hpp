// SPDX-License-Identifier: GPL-3.0-or-later
// Figures of a tetrahedral mesh's quality.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include "common/core/mesh.hpp"

namespace brainshift::test_support {

struct MeshQuality {
  double volume_mm3 = 0.0;
  double min_dihedral_deg = 0.0, max_dihedral_deg = 0.0;
  double min_edge_mm = 0.0, mean_edge_mm = 0.0, max_edge_mm = 0.0;
};

inline MeshQuality mesh_quality(const TetMesh& mesh) {
  MeshQuality quality;
  if (mesh.num_tets() == 0) return quality;
  constexpr int kEdges[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
  quality.min_dihedral_deg = 180.0;
  std::set<std::pair<int, int>> edges;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    std::array<Vec3, 4> x;
    for (std::size_t k = 0; k < 4; ++k) {
      x[k] = mesh.nodes.col(mesh.tets(static_cast<Eigen::Index>(k), t));
    }
    quality.volume_mm3 += Vec3(x[1] - x[0]).cross(x[2] - x[0]).dot(x[3] - x[0]) / 6.0;
    for (int edge = 0; edge < 6; ++edge) {
      // Seen along the edge (a, b), the angle between the directions to the two other nodes.
      const auto& [a, b] = kEdges[edge];
      const auto& [c, d] = kEdges[5 - edge];
      const Vec3 along = Vec3(x[b] - x[a]).normalized();
      const Vec3 u = (x[c] - x[a]) - along * along.dot(x[c] - x[a]);
      const Vec3 v = (x[d] - x[a]) - along * along.dot(x[d] - x[a]);
      const double angle = std::atan2(u.cross(v).norm(), u.dot(v)) * 180.0 / std::numbers::pi;
      quality.min_dihedral_deg = std::min(quality.min_dihedral_deg, angle);
      quality.max_dihedral_deg = std::max(quality.max_dihedral_deg, angle);
      edges.insert(std::minmax(mesh.tets(a, t), mesh.tets(b, t)));
    }
  }
  double sum = 0.0;
  quality.min_edge_mm = std::numeric_limits<double>::infinity();
  for (const auto& [a, b] : edges) {
    const double length = (mesh.nodes.col(a) - mesh.nodes.col(b)).norm();
    sum += length;
    quality.min_edge_mm = std::min(quality.min_edge_mm, length);
    quality.max_edge_mm = std::max(quality.max_edge_mm, length);
  }
  quality.mean_edge_mm = sum / static_cast<double>(edges.size());
  return quality;
}

}  // namespace brainshift::test_support
