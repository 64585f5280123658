// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/delivery/selections.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "common/geometry/node_choice.hpp"
#include "server/delivery/thin_nodes.hpp"

namespace brainshift::server {

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
  if (of_tumour && distances_under_way_.valid()) tumour_distance_mm_ = distances_under_way_.get();
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

}  // namespace brainshift::server
