// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/prepared/data_region.hpp"

#include <Eigen/Geometry>

#include "common/geometry/closest_point.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::inversion {

std::vector<NodeIndex> data_region(const BrainModel& model) {
  std::vector<char> near(static_cast<std::size_t>(model.mesh.num_nodes()), 0);
  const auto tumour = geometry::ClosestPointIndex::build(model.tumour);
  Eigen::AlignedBox3d box;  // no node outside is within the margin of the tumour
  for (const auto& vertex : model.tumour.vertices.colwise()) box.extend(vertex);
  box.min().array() -= kRegionMargin_mm;
  box.max().array() += kRegionMargin_mm;
  for (int i = 0; i < model.mesh.num_nodes(); ++i) {
    const Vec3 node = model.mesh.nodes.col(i);
    bool within = tumour && box.contains(node) &&
                  (tumour->closest(node).point - node).norm() < kRegionMargin_mm;
    for (std::size_t k = 0; !within && k < model.craniotomy.size(); ++k) {
      within = (model.mesh.nodes.col(model.craniotomy[k]) - node).norm() < kRegionMargin_mm;
    }
    near[static_cast<std::size_t>(i)] = static_cast<char>(within);
  }
  // Where elements are larger than the margin.
  const geometry::TetLocator locator(model.mesh);
  const auto add_element_at = [&](const Vec3& point) {
    const geometry::TetLocation location = locator.locate(point);
    for (const int node : location.nodes) near[static_cast<std::size_t>(node)] = 1;
  };
  for (int t = 0; t < model.tumour.num_triangles(); ++t) {
    Vec3 centre = Vec3::Zero();
    for (const int vertex : model.tumour.triangles.col(t)) {
      add_element_at(model.tumour.vertices.col(vertex));
      centre += model.tumour.vertices.col(vertex) / 3.0;
    }
    add_element_at(centre);
  }
  std::vector<NodeIndex> region;
  for (int i = 0; i < model.mesh.num_nodes(); ++i) {
    if (near[static_cast<std::size_t>(i)] != 0) region.push_back(i);
  }
  return region;
}

}  // namespace brainshift::inversion
