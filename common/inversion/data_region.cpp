// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/data_region.hpp"

#include <sstream>

#include "common/geometry/closest_point.hpp"

namespace brainshift::inversion {

std::vector<NodeIndex> data_region(const BrainModel& model) {
  std::vector<NodeIndex> region;
  const auto tumour = geometry::ClosestPointIndex::build(model.tumour);
  for (int i = 0; i < model.mesh.num_nodes(); ++i) {
    const Vec3 node = model.mesh.nodes.col(i);
    bool near = tumour && (tumour->closest(node).point - node).norm() < kRegionMargin_mm;
    for (std::size_t k = 0; !near && k < model.craniotomy.size(); ++k) {
      near = (model.mesh.nodes.col(model.craniotomy[k]) - node).norm() < kRegionMargin_mm;
    }
    if (near) region.push_back(i);
  }
  return region;
}

Status check_memory(std::uint64_t bytes, double limit_gib, int slaves, int nodes) {
  const double needed_gib = static_cast<double>(bytes) / (1024.0 * 1024.0 * 1024.0);
  if (needed_gib <= limit_gib) return {};
  std::ostringstream text;
  text.precision(3);
  text << "condensed.memory_limit_gib = " << limit_gib << ": the preparation needs " << needed_gib
       << " GiB (" << slaves << " slaves, " << nodes
       << " nodes); raise the limit or coarsen the mesh";
  return fail(ErrorCode::kInvalidArgument, text.str());
}

}  // namespace brainshift::inversion
