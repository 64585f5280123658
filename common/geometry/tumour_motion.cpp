// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/tumour_motion.hpp"

#include <algorithm>

#include "common/geometry/closest_point.hpp"

namespace brainshift::geometry {

std::vector<NodeIndex> tumour_nodes(const BrainModel& model) {
  std::vector<NodeIndex> nodes;
  const auto tumour = ClosestPointIndex::build(model.tumour);
  if (!tumour) return nodes;
  for (NodeIndex node = 0; node < model.mesh.nodes.cols(); ++node) {
    if (tumour->contains(model.mesh.nodes.col(node))) nodes.push_back(node);
  }
  return nodes;
}

std::optional<TumourMotion> tumour_motion(const Update& update,
                                          const std::vector<NodeIndex>& tumour) {
  const Estimate& estimate = update.estimate;
  const bool has_sd = estimate.sd_mm.size() == estimate.displacement.cols();
  double mm = 0.0, sd_mm = 0.0;
  int found = 0;
  for (Eigen::Index column = 0; column < estimate.displacement.cols(); ++column) {
    const auto node = update.part ? update.part->nodes[static_cast<std::size_t>(column)]
                                  : static_cast<NodeIndex>(column);
    if (!std::binary_search(tumour.begin(), tumour.end(), node)) continue;
    mm += estimate.displacement.col(column).norm();
    if (has_sd) sd_mm += estimate.sd_mm[column];
    ++found;
  }
  if (found == 0) return std::nullopt;
  return TumourMotion{mm / found, has_sd ? std::optional(sd_mm / found) : std::nullopt};
}

}  // namespace brainshift::geometry
