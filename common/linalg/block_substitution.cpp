// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/block_substitution.hpp"

#include <algorithm>

#include "common/linalg/blas.hpp"

namespace brainshift::linalg {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// The dense columns of one supernode: `corner`, lower triangular, of its own unknowns, and `below`
// of the rows `row` further down.
struct Supernode {
  Index first, width, rest;
  const long* row;
  Eigen::Map<const MatrixXd, 0, Eigen::OuterStride<>> corner, below;

  Supernode(const SupernodalView& l, std::size_t s)
      : first(l.first[s]),
        width(l.first[s + 1] - first),
        rest(l.rows[s + 1] - l.rows[s] - width),
        row(l.row_of + l.rows[s] + width),
        corner(l.values + l.at[s], width, width, Eigen::OuterStride<>(width + rest)),
        below(l.values + l.at[s] + width, rest, width, Eigen::OuterStride<>(width + rest)) {}
};

// X L^-T
void forward(const SupernodalView& l, MatrixXd& x, MatrixXd& scratch) {
  for (std::size_t s = 0; s + 1 < l.first.size(); ++s) {
    const Supernode node(l, s);
    auto own = x.middleCols(node.first, node.width);
    if ((own.array() == 0.0).all()) continue;
    blas::solve_lower_transposed_right(node.corner, own);
    if (node.rest == 0) continue;
    auto change = scratch.leftCols(node.rest);
    blas::multiply_by_transposed(1.0, own, node.below, 0.0, change);
    for (Index i = 0; i < node.rest; ++i) x.col(node.row[i]) -= change.col(i);
  }
}

// X L^-1
void backward(const SupernodalView& l, MatrixXd& x, MatrixXd& scratch) {
  for (std::size_t s = l.first.size() - 1; s-- > 0;) {
    const Supernode node(l, s);
    auto own = x.middleCols(node.first, node.width);
    if (node.rest > 0) {
      auto others = scratch.leftCols(node.rest);
      for (Index i = 0; i < node.rest; ++i) others.col(i) = x.col(node.row[i]);
      blas::multiply(-1.0, others, node.below, 1.0, own);
    }
    blas::solve_lower_right(node.corner, own);
  }
}

}  // namespace

void substitute(const SupernodalView& l, MatrixXd& x, MatrixXd& scratch) {
  Index most = 0;
  for (std::size_t s = 0; s + 1 < l.first.size(); ++s) most = std::max(most, Supernode(l, s).rest);
  if (scratch.rows() != x.rows() || scratch.cols() < most) scratch.resize(x.rows(), most);
  forward(l, x, scratch);
  backward(l, x, scratch);
}

}  // namespace brainshift::linalg
