// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/surface_patch.hpp"

#include <algorithm>
#include <map>

#include "common/geometry/surface.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::registration {

SurfacePatch craniotomy_patch(const BrainModel& model) {
  SurfacePatch patch;
  patch.nodes = model.craniotomy;
  std::sort(patch.nodes.begin(), patch.nodes.end());
  patch.surface =
      geometry::surface_between(model.mesh.nodes, model.boundary_triangles, patch.nodes);
  const auto count = static_cast<Eigen::Index>(patch.nodes.size());
  patch.weights.resize(count, count);
  patch.weights.setIdentity();
  return patch;
}

SurfacePatch tumour_patch(const BrainModel& model) {
  SurfacePatch patch;
  patch.surface = model.tumour;
  const geometry::TetLocator locator(model.mesh);
  std::vector<geometry::TetLocation> carriers;
  std::map<NodeIndex, int> rows;  // ascending
  for (const auto vertex : model.tumour.vertices.colwise()) {
    carriers.push_back(locator.locate(vertex));
    for (const int node : carriers.back().nodes) rows[node] = 0;
  }
  for (auto& [node, row] : rows) {
    row = static_cast<int>(patch.nodes.size());
    patch.nodes.push_back(node);
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t v = 0; v < carriers.size(); ++v) {
    for (int k = 0; k < 4; ++k) {
      entries.emplace_back(rows[carriers[v].nodes[k]], static_cast<int>(v), carriers[v].weights[k]);
    }
  }
  patch.weights.resize(static_cast<Eigen::Index>(patch.nodes.size()),
                       static_cast<Eigen::Index>(carriers.size()));
  patch.weights.setFromTriplets(entries.begin(), entries.end());
  return patch;
}

}  // namespace brainshift::registration
