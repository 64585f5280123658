// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "common/core/types.hpp"

namespace brainshift::inversion {

// The three rows of each given node of a node-major array (3n rows), 3 x size rows.
inline Eigen::MatrixXf gather_rows(const Eigen::MatrixXf& array,
                                   const std::vector<NodeIndex>& nodes) {
  Eigen::MatrixXf rows(3 * static_cast<Eigen::Index>(nodes.size()), array.cols());
  for (Eigen::Index j = 0; j < array.cols(); ++j) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      rows.col(j).segment<3>(3 * static_cast<Eigen::Index>(i)) =
          array.col(j).segment<3>(3L * nodes[i]);
    }
  }
  return rows;
}

}  // namespace brainshift::inversion
