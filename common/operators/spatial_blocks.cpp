// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/operators/spatial_blocks.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace brainshift {
namespace {

// Splits the places [begin, end) and appends the ends of their blocks.
void split(const Points& points, int most, int begin, int end, SpatialBlocks& blocks) {
  const int count = end - begin;
  if (count <= most) {
    if (count > 0) blocks.first.push_back(end);
    return;
  }
  const auto part = std::span(blocks.order)
                        .subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(count));
  Vec3 low = points.col(part.front()), high = low;
  for (const int i : part) {
    low = low.cwiseMin(points.col(i));
    high = high.cwiseMax(points.col(i));
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  // Parts of whole blocks, so that all blocks are about as large.
  const int parts = (count + most - 1) / most;
  const int middle =
      static_cast<int>(static_cast<long>(count) * (parts / 2) / static_cast<long>(parts));
  std::nth_element(part.begin(), part.begin() + middle, part.end(), [&](int a, int b) {
    return points(axis, a) != points(axis, b) ? points(axis, a) < points(axis, b) : a < b;
  });
  split(points, most, begin, begin + middle, blocks);
  split(points, most, begin + middle, end, blocks);
}

}  // namespace

SpatialBlocks spatial_blocks(const Points& points, int most) {
  assert(most >= 1);
  SpatialBlocks blocks;
  blocks.order.resize(static_cast<std::size_t>(points.cols()));
  std::iota(blocks.order.begin(), blocks.order.end(), 0);
  split(points, most, 0, static_cast<int>(points.cols()), blocks);
  return blocks;
}

}  // namespace brainshift
