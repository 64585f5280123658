// SPDX-License-Identifier: GPL-3.0-or-later
// MovingData: data that depend on where the brain is, such as distances to a measured surface,
// whose closest points move with the estimate.
#pragma once

#include <functional>
#include <vector>

#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// The inversion measures the data anew for every estimate until they stay where they are.
struct MovingData {
  std::vector<NodeIndex> nodes;  // relocate() is given the displacement of these nodes
  // u: 3 x nodes, mm. Replaces `data` and returns true; returns false when the data have not moved
  // enough to matter.
  std::function<bool(const Points& u, SparseData& data)> relocate;
};

}  // namespace brainshift::inversion
