// SPDX-License-Identifier: Apache-2.0
// The columns of 3 x n points as the point set that a k-d tree (nanoflann) asks for. Keeps a reference.
#pragma once

#include <cstddef>

#include "common/core/types.hpp"

namespace brainshift {

struct PointColumns {
  const Points& points;
  std::size_t kdtree_get_point_count() const { return static_cast<std::size_t>(points.cols()); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(i));
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;  // the tree finds it itself
  }
};

}  // namespace brainshift
