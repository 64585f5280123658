// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/geometry/region_nodes.hpp"

#include <fmt/format.h>

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

}  // namespace brainshift::geometry
