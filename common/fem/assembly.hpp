// SPDX-License-Identifier: GPL-3.0-or-later
// From 3 x 3 blocks of element node pairs to the lower triangle of T^T K T. All elements share
// it; private to fem.
#pragma once

#include "common/fem/dof_map.hpp"
#include "common/linalg/symmetric_matrix.hpp"

namespace brainshift::fem {

// Zero matrix with the pattern of the assembled lower triangle: the nodes of an element are
// coupled pairwise. elements: nodes per element x m.
linalg::SymmetricMatrix lower_pattern(const Eigen::Ref<const Eigen::MatrixXi>& elements,
                                      const DofMap& dofs);

// Adds the 3 x 3 block (RAS axes) of the node pair (row node, column node) to the lower triangle.
// Skips entries above the diagonal and those of constrained unknowns. Precondition: some element
// holds both nodes.
void add_block(linalg::SymmetricMatrix& lower, const DofMap& dofs, NodeIndex row_node,
               NodeIndex column_node, Mat3 block);

// Assembles element by element. element_blocks(e) returns a function of two local nodes that
// gives their block in RAS axes. Only blocks on and below the diagonal (by global node) are
// requested.
template <typename ElementBlocks>
linalg::SymmetricMatrix assemble_lower(const Eigen::Ref<const Eigen::MatrixXi>& elements,
                                       const DofMap& dofs, const ElementBlocks& element_blocks) {
  linalg::SymmetricMatrix lower = lower_pattern(elements, dofs);
  for (Eigen::Index e = 0; e < elements.cols(); ++e) {
    const auto block = element_blocks(static_cast<int>(e));
    for (int i = 0; i < elements.rows(); ++i) {
      for (int j = 0; j < elements.rows(); ++j) {
        const int row_node = elements(i, e);
        const int column_node = elements(j, e);
        if (row_node < column_node) continue;
        add_block(lower, dofs, row_node, column_node, block(i, j));
      }
    }
  }
  return lower;
}

}  // namespace brainshift::fem
