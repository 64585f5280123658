// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/mesh_components.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>

namespace brainshift::geometry {
namespace {

struct ComponentFace {
  std::array<int, 3> nodes;  // increasing
  int tet;
};

std::vector<ComponentFace> sorted_faces(const Eigen::Matrix<int, 4, Eigen::Dynamic>& tets) {
  std::vector<ComponentFace> faces;
  faces.reserve(4 * static_cast<std::size_t>(tets.cols()));
  for (int t = 0; t < static_cast<int>(tets.cols()); ++t)
    for (int omit = 0; omit < 4; ++omit) {
      ComponentFace face{
          {tets((omit + 1) % 4, t), tets((omit + 2) % 4, t), tets((omit + 3) % 4, t)}, t};
      std::sort(face.nodes.begin(), face.nodes.end());
      faces.push_back(face);
    }
  std::sort(faces.begin(), faces.end(),
            [](const ComponentFace& a, const ComponentFace& b) { return a.nodes < b.nodes; });
  return faces;
}

}  // namespace

TetComponents tet_components(const Eigen::Matrix<int, 4, Eigen::Dynamic>& tets) {
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
  const std::vector<ComponentFace> faces = sorted_faces(tets);
  for (std::size_t f = 1; f < faces.size(); ++f) {
    if (faces[f].nodes != faces[f - 1].nodes) continue;
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

}  // namespace brainshift::geometry
