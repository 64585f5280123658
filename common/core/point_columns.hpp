// SPDX-License-Identifier: Apache-2.0
// PointColumns: adapter that lets nanoflann build a k-d tree over the columns of a 3 x n matrix.
//
// nanoflann asks its data set for three member functions with fixed names; these are they. The
// adapter copies nothing: `points` must outlive the tree and must not change while the tree is in
// use.
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
    return false;  // the tree computes the bounding box itself
  }
};

}  // namespace brainshift
