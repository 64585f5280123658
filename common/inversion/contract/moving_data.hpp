// SPDX-License-Identifier: GPL-3.0-or-later
// Data that depend on where the brain is: distances to a measured surface, whose closest points move with it.
#pragma once

#include <functional>
#include <vector>

#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// The data are measured anew for an estimate until they stay where they are.
struct MovingData {
  std::vector<NodeIndex> nodes;  // whose displacement relocate() is given
  // u: 3 x nodes, mm. Replaces `data` and returns true, or returns false when they have not moved enough to matter.
  std::function<bool(const Points& u, SparseData& data)> relocate;
};

}  // namespace brainshift::inversion
