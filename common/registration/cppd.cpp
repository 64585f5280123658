// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/cppd.hpp"

#include <cmath>

namespace brainshift::registration {

VecX signed_projection_distance(const Points& nodes, const geometry::ClosestPointIndex& surface) {
  VecX distances(nodes.cols());
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    const Vec3 node = nodes.col(i);
    const geometry::ClosestPoint closest = surface.closest(node);
    const double outwards = (node - closest.point).dot(surface.pseudo_normal(closest));
    distances[i] = outwards > 0.0 ? -closest.distance_mm : closest.distance_mm;
  }
  return distances;
}

MeanStd mismatch(const VecX& signed_distances) {
  const VecX magnitudes = signed_distances.cwiseAbs();
  return mean_std({magnitudes.data(), static_cast<std::size_t>(magnitudes.size())});
}

}  // namespace brainshift::registration
