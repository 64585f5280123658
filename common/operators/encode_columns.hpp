// SPDX-License-Identifier: GPL-3.0-or-later
// MatrixXf -> CompactColumns: fields of one mesh, [U G] of a patient, made small.
//
// The columns of a group (U, G) have one step. A number is off by kMaxErrorSteps at most (checked
// against the numbers given), by 0.4 steps typically. Steps of less than kFinest of the greatest
// number are finer than sums in single precision: the limit is then that of kFinest.
// docs/decisions/0028 says what that does to fields.
//
// Blocks: neighbours, kBlockNodes at most (SpatialBlocks). With M_b the rows of a block in steps, W
// = M_b M_b^T is factorised by Cholesky with pivoting until the rows that are left are below kLeft
// in the root mean square, W ~ L L^T (Harbrecht, Peters and Schneider 2012, Appl. Numer. Math.
// 62:428); the basis is that of L's columns (Householder), and the coefficients are Q^T M_b,
// rounded. Where a number is still off by more than kMaxErrorSteps, the block is done again with
// more columns.
#pragma once

#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/core/thread_team.hpp"
#include "common/core/types.hpp"
#include "common/operators/compact_columns.hpp"
#include "common/ranks/ranks.hpp"

namespace brainshift {

// Points in blocks of neighbours.
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

inline constexpr double kMaxErrorSteps = 4.0;      // steps
inline constexpr float kFinest = 1.0F / 16777216;  // 2^-24

// Columns that need not lie in memory: they are read once, by the rows of a block.
struct ColumnGroup {
  int count = 0;
  float step = 0.0F;      // of the greatest number; at least 2^-26: coefficients fit 31 bits
  float greatest = 0.0F;  // greatest_of() all columns
  // The rows of the given nodes, which stand at `place` and behind it in the order of all blocks,
  // into `rows`, 3m x count. Called by several threads at once.
  std::function<Status(std::span<const NodeIndex> nodes, Eigen::Index place, Eigen::MatrixXf& rows)>
      rows;
};
// Of columns in memory, 3n rows, which the group refers to.
ColumnGroup group_of(const Eigen::MatrixXf& columns, float step);
// The greatest absolute number; NaN when one is not finite.
float greatest_of(const Eigen::MatrixXf& numbers);

// The blocks of encode_columns(). nodes: 3 x n, mm.
SpatialBlocks node_blocks(const Points& nodes);

// groups: one after the other. nodes: node_blocks() of the mesh. Dealt to the team by blocks; the
// result does not depend on its size. kNotFinite; kUnavailable when stopped; kInternal when
// kMaxErrorSteps is not kept; errors of the groups. progress: stage "compact columns". ranks:
// processes that have the same groups at the nodes of their own blocks (Ranks::first); the first
// one gets the columns, the others get none.
Result<CompactColumns> encode_columns(const SpatialBlocks& nodes,
                                      const std::vector<ColumnGroup>& groups, ThreadTeam& team,
                                      const Progress& progress = {},
                                      const std::stop_token& stop = {}, Ranks* ranks = nullptr);

// Rows of the given nodes (3 each, in their order) of the given columns, in single precision.
// Numbers are rounded as the shape of the request lets them: 6e-8 of the largest of their column.
Eigen::MatrixXf decode_rows(const CompactColumns& columns, const std::vector<NodeIndex>& nodes,
                            const std::vector<int>& which, ThreadTeam& team);
// first, first + 1, ...
std::vector<int> column_range(int first, int count);

}  // namespace brainshift
