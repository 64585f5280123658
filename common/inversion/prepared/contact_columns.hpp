// SPDX-License-Identifier: GPL-3.0-or-later
// G = K^-1 N, the responses to unit forces along the slaves' normals, and Phi = N^T G.
//
// Slaves that are neighbours are solved together (linalg/block_substitution.hpp). A block of
// columns goes to a BlockStore as soon as it is finished, and comes back by rows when all of G is
// made compact: with a store on disk G is never in memory as a whole.
#pragma once

#include <functional>
#include <vector>

#include "common/core/error.hpp"
#include "common/inversion/prepared/block_runner.hpp"
#include "common/operators/condensed_operators.hpp"
#include "common/operators/encode_columns.hpp"
#include "common/operators/spatial_blocks.hpp"

namespace brainshift::inversion {

// Keeps finished blocks; on disk, so that they need no memory and an interrupted preparation can go
// on. `rows`: count x 3n, the block's columns as rows, so that the 3m numbers of neighbouring nodes
// in a column stand near those of the next one; nodes in the order of node_blocks().
struct BlockStore {
  // Fills both arrays, which have the shape of the block; false when block `index` is not kept.
  std::function<bool(int index, Eigen::MatrixXf& rows, Eigen::MatrixXd& compliance)> load;
  std::function<Status(int index, const Eigen::MatrixXf& rows, const Eigen::MatrixXd& compliance)>
      save;
  // Columns [first, first + out.cols()) of the `rows` of a block that was saved or loaded. Called
  // by several threads at once; the others by one at a time.
  std::function<Status(int index, Eigen::Index first, Eigen::MatrixXf& out)> read;

  bool keeps() const { return static_cast<bool>(save); }
};
// Keeps the rows of `blocks` blocks in memory for as long as the store or a copy of it lives.
BlockStore memory_store(int blocks);

struct ContactColumns {
  std::vector<int> order;  // of the slaves, block after block of BlockRunner::block_size()
  BlockStore store;
  float greatest = 0.0F;

  // For encode_columns(): the columns in the order of the slaves. Refers to this.
  ColumnGroup group(float step) const;
};

// Fills slaves, slave_normals and initial_penetration_mm.
void add_slaves(const PreparedModel& model, CondensedOperators& result);

// Fills compliance; after add_slaves(). nodes: node_blocks() of the mesh. store: that of the
// columns, or one that keeps nothing: then they stay in memory. progress: stage "contact columns".
// Errors of the runner and of the store; kNotFinite.
Result<ContactColumns> solve_contact_columns(const PreparedModel& model, const SpatialBlocks& nodes,
                                             BlockStore store, BlockRunner& runner,
                                             CondensedOperators& result);

}  // namespace brainshift::inversion
