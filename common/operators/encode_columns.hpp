// SPDX-License-Identifier: GPL-3.0-or-later
// MatrixXf -> CompactColumns: fields of one mesh, [U G] of a patient, made small.
//
// The columns of a group (U, G) have one step. A number is off by kMostErrorSteps at most (checked
// against the numbers given), by 0.4 steps typically. Steps of less than kFinest of the greatest
// number are finer than sums in single precision: the limit is then that of kFinest.
// docs/decisions/0028 says what that does to fields.
//
// Blocks: nodes are halved across the longest extent until a part has kBlockNodes at most. With M_b
// the rows of a block in steps, W = M_b M_b^T is factorised by Cholesky with pivoting until the
// rows that are left are below kLeft in the root mean square, W ~ L L^T (Harbrecht, Peters and
// Schneider 2012, Appl. Numer. Math. 62:428); the basis is that of L's columns (Householder), and
// the coefficients are Q^T M_b, rounded. Where a number is still off by more than kMostErrorSteps,
// the block is done again with more columns.
#pragma once

#include <stop_token>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/core/thread_team.hpp"
#include "common/core/types.hpp"
#include "common/operators/compact_columns.hpp"

namespace brainshift {

inline constexpr double kMostErrorSteps = 4.0;     // steps
inline constexpr float kFinest = 1.0F / 16777216;  // 2^-24

struct ColumnGroup {
  const Eigen::MatrixXf* columns = nullptr;  // 3n rows
  float step = 0.0F;  // of their greatest number; at least 2^-26: coefficients fit 31 bits
};

// groups: one after the other. nodes: 3 x n, mm. Dealt to the team by blocks; the result does not
// depend on its size. kNotFinite; kUnavailable when stopped; kInternal when
// kMostErrorSteps is not kept. progress: stage "compact columns".
Result<CompactColumns> encode_columns(const Points& nodes, const std::vector<ColumnGroup>& groups,
                                      ThreadTeam& team, const Progress& progress = {},
                                      const std::stop_token& stop = {});

// Rows of the given nodes (3 each, in their order) of the given columns, in single precision.
// Numbers are rounded as the shape of the request lets them: 6e-8 of the largest of their column.
Eigen::MatrixXf decode_rows(const CompactColumns& columns, const std::vector<NodeIndex>& nodes,
                            const std::vector<int>& which, ThreadTeam& team);
// first, first + 1, ...
std::vector<int> column_range(int first, int count);

}  // namespace brainshift
