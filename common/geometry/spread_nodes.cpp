// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/spread_nodes.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>

namespace brainshift::geometry {

std::vector<NodeIndex> spread_nodes(const Points& nodes, int count) {
  std::vector<NodeIndex> chosen;
  if (nodes.cols() == 0) return chosen;
  count = std::min<int>(count, static_cast<int>(nodes.cols()));
  VecX distance = VecX::Constant(nodes.cols(), std::numeric_limits<double>::infinity());
  Eigen::Index next = 0;
  while (static_cast<int>(chosen.size()) < count) {
    chosen.push_back(static_cast<NodeIndex>(next));
    const Vec3 point = nodes.col(next);
    for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
      distance[i] = std::min(distance[i], (nodes.col(i) - point).squaredNorm());
    }
    distance.maxCoeff(&next);
  }
  return chosen;
}

Interpolation interpolate(const Points& sources, const Points& targets) {
  assert(sources.cols() >= 1);
  Interpolation result;
  result.neighbours.setZero(4, targets.cols());
  result.weights.setZero(4, targets.cols());
  const int used = static_cast<int>(std::min<Eigen::Index>(4, sources.cols()));
  for (Eigen::Index i = 0; i < targets.cols(); ++i) {
    std::array<double, 4> nearest;
    nearest.fill(std::numeric_limits<double>::infinity());
    std::array<int, 4> index{};
    for (Eigen::Index j = 0; j < sources.cols(); ++j) {
      double distance = (sources.col(j) - targets.col(i)).squaredNorm();
      int source = static_cast<int>(j);
      for (int k = 0; k < used; ++k) {  // insertion into the short sorted list
        if (distance >= nearest[k]) continue;
        std::swap(distance, nearest[k]);
        std::swap(source, index[k]);
      }
    }
    double sum = 0.0;
    std::array<double, 4> weight{};
    for (int k = 0; k < used; ++k) sum += weight[k] = 1.0 / (nearest[k] + 1e-6);
    for (int k = 0; k < used; ++k) {
      result.neighbours(k, i) = index[k];
      result.weights(k, i) = static_cast<float>(weight[k] / sum);
    }
  }
  return result;
}

}  // namespace brainshift::geometry
