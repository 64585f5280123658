// SPDX-License-Identifier: GPL-3.0-or-later
// Points in blocks of neighbours.
#pragma once

#include <span>
#include <vector>

#include "common/core/types.hpp"

namespace brainshift {

struct SpatialBlocks {
  std::vector<int> order;     // every point once, block after block
  std::vector<int> first{0};  // of each block its first place in `order`; at last their number

  int size() const { return static_cast<int>(first.size()) - 1; }
  std::span<const int> block(int b) const {
    const auto at = static_cast<std::size_t>(b);
    return std::span(order).subspan(static_cast<std::size_t>(first[at]),
                                    static_cast<std::size_t>(first[at + 1] - first[at]));
  }
};

// Halves the points across their longest extent until a part has `most` at most; parts are of about
// the same size. The result depends on the points alone. points: 3 x n. most >= 1.
SpatialBlocks spatial_blocks(const Points& points, int most);

}  // namespace brainshift
