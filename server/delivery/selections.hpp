// SPDX-License-Identifier: GPL-3.0-or-later
// Selections: which nodes of the loaded model the viewers' choices are. Each distinct choice is
// worked out once and shared for as long as a viewer has it: equal choices are the same pointer.
//
// Made once for a model. The distances of its nodes from the tumour take a head some tenths of a
// second; they are worked out on a thread of their own, so that the daemon's start does not wait,
// and the first choice of the tumour waits for the rest of it. After that a choice costs a pass
// over the nodes, and thinning. Belongs to the transport thread.
#pragma once

#include <future>
#include <memory>
#include <vector>

#include "common/core/error.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/session_state.hpp"

namespace brainshift::server {

// Nodes at least a spacing apart, with one of them near every other: a maximal Poisson-disk sample,
// taken greedily in the order of the nodes, those of the boundary first.
//
//   |x_a - x_b| >= spacing for chosen nodes a, b
//   every candidate has a chosen node nearer than the spacing; one of the boundary has a chosen one
//   of the boundary
//
// candidates: ascending. on_boundary: one entry per node. spacing_mm > 0. Ascending; the same
// for the same input on every machine.
std::vector<NodeIndex> thin_nodes(const Points& nodes, const std::vector<NodeIndex>& candidates,
                                  const std::vector<bool>& on_boundary, double spacing_mm);

class Selections {
 public:
  explicit Selections(const std::shared_ptr<const BrainModel>& model);

  // Null for the default choice: everything. kEmptySet: no node lies in the region, or the model
  // has no tumour; the sentence names the region. Otherwise the errors of validate(FieldChoice).
  Result<SelectionPtr> resolve(const FieldChoice& choice);

 private:
  Result<std::vector<NodeIndex>> nodes_of(const Region& region);

  std::shared_ptr<const BrainModel> model_;
  std::vector<bool> on_boundary_;  // one per node
  // One per node, negative inside; empty: no tumour, or not asked for yet.
  std::vector<double> tumour_distance_mm_;
  std::future<std::vector<double>> distances_under_way_;  // until they are asked for
  std::vector<std::weak_ptr<const Selection>> known_;     // that viewers have now
};

}  // namespace brainshift::server
