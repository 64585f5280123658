// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/node_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <numeric>
#include <string>

#include "common/geometry/closest_point.hpp"

namespace brainshift::geometry {
namespace {

std::string describe(const Region& region) {
  if (const auto* ball = std::get_if<BallRegion>(&region)) {
    const Vec3& at = ball->centre_mm;
    return fmt::format("the ball of {} mm about ({}, {}, {}) mm", ball->radius_mm, at[0], at[1],
                       at[2]);
  }
  if (const auto* tumour = std::get_if<TumourRegion>(&region)) {
    return fmt::format("the tumour with a margin of {} mm", tumour->margin_mm);
  }
  return "the brain";
}

template <typename Holds>
std::vector<NodeIndex> nodes_where(int count, const Holds& holds) {
  std::vector<NodeIndex> nodes;
  for (NodeIndex node = 0; node < count; ++node) {
    if (holds(node)) nodes.push_back(node);
  }
  return nodes;
}

}  // namespace

std::vector<double> distances_from_tumour(const BrainModel& model) {
  const auto tumour = ClosestPointIndex::build(model.tumour);
  if (!tumour) return {};
  const Vec3 low = model.tumour.vertices.rowwise().minCoeff();
  const Vec3 high = model.tumour.vertices.rowwise().maxCoeff();
  std::vector<double> distances;
  distances.reserve(static_cast<std::size_t>(model.mesh.nodes.cols()));
  for (const auto& column : model.mesh.nodes.colwise()) {
    const Vec3 node = column;
    const bool in_box = (node.array() >= low.array()).all() && (node.array() <= high.array()).all();
    const double distance = tumour->closest(node).distance_mm;
    distances.push_back(in_box && tumour->contains(node) ? -distance : distance);
  }
  return distances;
}

Result<std::vector<NodeIndex>> nodes_in_region(const BrainModel& model, const Region& region,
                                               const std::vector<double>& tumour_distance_mm) {
  const Points& places = model.mesh.nodes;
  const int count = model.mesh.num_nodes();
  std::vector<NodeIndex> nodes;
  if (const auto* ball = std::get_if<BallRegion>(&region)) {
    nodes = nodes_where(count, [&](NodeIndex node) {
      return (places.col(node) - ball->centre_mm).norm() <= ball->radius_mm;
    });
  } else if (const auto* tumour = std::get_if<TumourRegion>(&region)) {
    if (tumour_distance_mm.empty()) return fail(ErrorCode::kEmptySet, "the model has no tumour");
    nodes = nodes_where(count, [&](NodeIndex node) {
      return tumour_distance_mm[static_cast<std::size_t>(node)] <= tumour->margin_mm;
    });
  } else {
    nodes.resize(static_cast<std::size_t>(count));
    std::iota(nodes.begin(), nodes.end(), 0);
  }
  if (nodes.empty()) return fail(ErrorCode::kEmptySet, "no node lies in " + describe(region));
  return nodes;
}

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
