// SPDX-License-Identifier: GPL-3.0-or-later
// X = (L L^T)^-1 B for a block of right-hand sides, by the supernodes of L.
//
// The block lies with the numbers of one unknown side by side (k x n, k right-hand sides), so that
// what is gathered and scattered at a supernode's rows are whole columns. A supernode whose
// unknowns are all 0 in every right-hand side is passed over: a load at a few nodes reaches only
// their ancestors in the elimination tree (Gilbert and Peierls 1988, SIAM J. Sci. Stat. Comput.
// 9:862). Loads that are near each other have most ancestors in common, so it pays to solve such
// loads together.
#pragma once

#include <Eigen/Core>
#include <span>

namespace brainshift::linalg {

// A view of L. Supernode s has the unknowns [first[s], first[s + 1]), and its columns are dense
// below each other: rows row_of[rows[s] ... rows[s + 1]), the unknowns themselves first, numbers
// from values[at[s]], column-major.
struct SupernodalView {
  std::span<const long> first;  // of s supernodes, s + 1 numbers; rows alike
  std::span<const long> rows;
  std::span<const long> at;
  const long* row_of = nullptr;
  const double* values = nullptr;
};

// In place. x: k x n, in the order of L's unknowns. scratch: keeps its memory between calls.
void substitute(const SupernodalView& l, Eigen::MatrixXd& x, Eigen::MatrixXd& scratch);

}  // namespace brainshift::linalg
