// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/delivery/selections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "common/geometry/closest_point.hpp"
#include "server/delivery/thin_nodes.hpp"

namespace brainshift::server {
namespace {

std::vector<double> distances_from_tumour(const BrainModel& model) {
  const auto tumour = geometry::ClosestPointIndex::build(model.tumour);
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

Selections::Selections(const std::shared_ptr<const BrainModel>& model)
    : model_(model),
      on_boundary_(static_cast<std::size_t>(model->mesh.nodes.cols()), false),
      distances_under_way_(
          std::async(std::launch::async, [model] { return distances_from_tumour(*model); })) {
  for (const int node : model_->boundary_triangles.reshaped()) {
    on_boundary_[static_cast<std::size_t>(node)] = true;
  }
}

Result<std::vector<NodeIndex>> Selections::nodes_of(const Region& region) {
  const Points& places = model_->mesh.nodes;
  const int count = static_cast<int>(places.cols());
  std::vector<NodeIndex> nodes;
  if (const auto* ball = std::get_if<BallRegion>(&region)) {
    nodes = nodes_where(count, [&](NodeIndex node) {
      return (places.col(node) - ball->centre_mm).norm() <= ball->radius_mm;
    });
  } else if (const auto* tumour = std::get_if<TumourRegion>(&region)) {
    if (distances_under_way_.valid()) tumour_distance_mm_ = distances_under_way_.get();
    if (tumour_distance_mm_.empty()) {
      return fail(ErrorCode::kEmptySet, "choice: the model has no tumour");
    }
    nodes = nodes_where(count, [&](NodeIndex node) {
      return tumour_distance_mm_[static_cast<std::size_t>(node)] <= tumour->margin_mm;
    });
  } else {
    nodes.resize(static_cast<std::size_t>(count));
    std::iota(nodes.begin(), nodes.end(), 0);
  }
  if (nodes.empty()) {
    return fail(ErrorCode::kEmptySet, "choice: no node lies in " + describe(region));
  }
  return nodes;
}

Result<SelectionPtr> Selections::resolve(const FieldChoice& choice) {
  if (choice == FieldChoice{}) return SelectionPtr{};
  if (Status status = validate(choice); !status) return tl::unexpected(status.error());
  std::erase_if(known_, [](const auto& known) { return known.expired(); });
  for (const auto& known : known_) {
    if (auto selection = known.lock(); selection->choice == choice) return selection;
  }
  return nodes_of(choice.region).map([&](std::vector<NodeIndex> nodes) {
    if (choice.spacing_mm > 0.0) {
      nodes = thin_nodes(model_->mesh.nodes, nodes, on_boundary_, choice.spacing_mm);
    }
    const int count = static_cast<int>(model_->mesh.nodes.cols());
    const SelectionPtr selection =
        std::make_shared<const Selection>(Selection{choice, count, std::move(nodes)});
    known_.push_back(selection);
    return selection;
  });
}

}  // namespace brainshift::server
