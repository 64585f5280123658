// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/delivery/selections.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "common/geometry/node_choice.hpp"

namespace brainshift::server {
namespace {

// Chosen nodes by cells of the spacing's size: whoever is nearer than that is in a neighbouring
// cell.
class ChosenNodes {
 public:
  ChosenNodes(const Points& nodes, double spacing_mm) : nodes_(nodes), spacing_mm_(spacing_mm) {}

  bool any_near(NodeIndex node) const {
    const std::array<std::int64_t, 3> cell = cell_of(node);
    for (std::int64_t i = -1; i <= 1; ++i) {
      for (std::int64_t j = -1; j <= 1; ++j) {
        for (std::int64_t k = -1; k <= 1; ++k) {
          if (near_in({cell[0] + i, cell[1] + j, cell[2] + k}, node)) return true;
        }
      }
    }
    return false;
  }
  void add(NodeIndex node) { cells_[key(cell_of(node))].push_back(node); }

 private:
  std::array<std::int64_t, 3> cell_of(NodeIndex node) const {
    std::array<std::int64_t, 3> cell{};
    for (int axis = 0; axis < 3; ++axis) {
      cell[static_cast<std::size_t>(axis)] =
          static_cast<std::int64_t>(std::floor(nodes_(axis, node) / spacing_mm_));
    }
    return cell;
  }
  // Cells that share a key only cost time: distances decide.
  static std::uint64_t key(const std::array<std::int64_t, 3>& cell) {
    std::uint64_t mixed = 0;
    for (const std::int64_t part : cell) {
      mixed = (mixed ^ static_cast<std::uint64_t>(part)) * 0x9e3779b97f4a7c15u;
      mixed ^= mixed >> 29;
    }
    return mixed;
  }
  bool near_in(const std::array<std::int64_t, 3>& cell, NodeIndex node) const {
    const auto found = cells_.find(key(cell));
    if (found == cells_.end()) return false;
    return std::any_of(found->second.begin(), found->second.end(), [&](NodeIndex other) {
      return (nodes_.col(other) - nodes_.col(node)).norm() < spacing_mm_;
    });
  }

  const Points& nodes_;
  double spacing_mm_;
  std::unordered_map<std::uint64_t, std::vector<NodeIndex>> cells_;
};

}  // namespace

Selections::Selections(const std::shared_ptr<const BrainModel>& model)
    : model_(model),
      on_boundary_(static_cast<std::size_t>(model->mesh.nodes.cols()), false),
      distances_under_way_(std::async(
          std::launch::async, [model] { return geometry::distances_from_tumour(*model); })) {
  for (const int node : model_->boundary_triangles.reshaped()) {
    on_boundary_[static_cast<std::size_t>(node)] = true;
  }
}

Result<std::vector<NodeIndex>> Selections::nodes_of(const Region& region) {
  const bool of_tumour = std::holds_alternative<TumourRegion>(region);
  if (of_tumour && tumour_distance_mm_.empty()) {
    // Without a future to wait for, they are made anew: the one before found no memory.
    tumour_distance_mm_ = distances_under_way_.valid() ? distances_under_way_.get()
                                                       : geometry::distances_from_tumour(*model_);
  }
  auto nodes = geometry::nodes_in_region(*model_, region, tumour_distance_mm_);
  if (!nodes) return fail(nodes.error().code, "choice: " + nodes.error().message);
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
    SelectionPtr selection =
        std::make_shared<const Selection>(Selection{choice, count, std::move(nodes)});
    known_.push_back(selection);
    return selection;
  });
}

std::vector<NodeIndex> thin_nodes(const Points& nodes, const std::vector<NodeIndex>& candidates,
                                  const std::vector<bool>& on_boundary, double spacing_mm) {
  ChosenNodes chosen(nodes, spacing_mm);
  std::vector<NodeIndex> kept;
  for (const bool boundary : {true, false}) {
    for (const NodeIndex node : candidates) {
      if (on_boundary[static_cast<std::size_t>(node)] != boundary || chosen.any_near(node)) {
        continue;
      }
      chosen.add(node);
      kept.push_back(node);
    }
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

}  // namespace brainshift::server
