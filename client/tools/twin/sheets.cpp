// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/twin/sheets.hpp"

#include <Eigen/Geometry>
#include <map>
#include <utility>

namespace brainshift::client {

std::vector<SheetNode> sheet_nodes(const Septa& septa, const fem::DisplacementSpace& space) {
  std::map<NodeIndex, std::pair<Vec3, double>> out_of;  // areas as vectors and as numbers
  for (const auto& face : septa.triangles.colwise()) {
    const Vec3 a = space.nodes.col(face[0]);
    const Vec3 area = Vec3(space.nodes.col(face[1]) - a).cross(Vec3(space.nodes.col(face[2]) - a));
    const auto nodes = fem::face_nodes(space, face);
    for (int k = 0; k < space.nodes_per_face(); ++k) {
      auto& sum =
          out_of.try_emplace(nodes[static_cast<std::size_t>(k)], Vec3::Zero(), 0.0).first->second;
      sum.first += area;
      sum.second += area.norm();
    }
  }
  std::vector<SheetNode> sides;
  for (const auto& [node, sum] : out_of) {
    if (sum.first.norm() < 0.1 * sum.second) continue;
    sides.push_back({node, sum.first.normalized()});
  }
  return sides;
}

Points nodes_in_their_sides(const BrainModel& model) {
  Points nodes = model.mesh.nodes;
  if (model.septa.triangles.cols() == 0) return nodes;
  const fem::DisplacementSpace space = fem::make_space(model.mesh, fem::Element::kP1);
  for (const SheetNode& side : sheet_nodes(model.septa, space)) {
    nodes.col(side.node) -= kIntoSide_mm * side.normal;
  }
  return nodes;
}

}  // namespace brainshift::client
