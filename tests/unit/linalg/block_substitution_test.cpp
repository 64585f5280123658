// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/block_substitution.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "common/core/random.hpp"

namespace brainshift::linalg {
namespace {

using Eigen::MatrixXd;

// Supernodes {0, 1}, {2} and {3, 4}; the first reaches row 3, the second rows 3 and 4.
struct Factor {
  std::vector<long> first{0, 2, 3, 5}, rows{0, 3, 6, 8}, at{0, 6, 9, 13};
  std::vector<long> row_of{0, 1, 3, 2, 3, 4, 3, 4};
  std::vector<double> values;
  MatrixXd dense = MatrixXd::Zero(5, 5);

  Factor() {
    Random random(8);
    values.resize(13);
    for (std::size_t s = 0; s < 3; ++s) {
      const long count = rows[s + 1] - rows[s];
      for (long j = 0; j < first[s + 1] - first[s]; ++j) {
        for (long i = 0; i < count; ++i) {
          // What lies above the diagonal is not to be read.
          double& value = values[static_cast<std::size_t>(at[s] + j * count + i)];
          value = i < j ? 1e30 : (i == j ? 2.0 : 0.0) + random.uniform();
          if (i >= j) dense(row_of[static_cast<std::size_t>(rows[s] + i)], first[s] + j) = value;
        }
      }
    }
  }
  SupernodalView view() const { return {first, rows, at, row_of.data(), values.data()}; }
  MatrixXd solve(const MatrixXd& b) const {
    return (dense * dense.transpose()).fullPivLu().solve(b);
  }
};

void expect_solved(const Factor& factor, const MatrixXd& b) {
  MatrixXd x = b.transpose(), scratch;
  substitute(factor.view(), x, scratch);
  EXPECT_LT((x.transpose() - factor.solve(b)).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(BlockSubstitution, EqualsADenseSolve) {
  Random random(9);
  MatrixXd b(5, 3);
  for (double& value : b.reshaped()) value = random.normal();
  expect_solved(Factor(), b);
}

// Supernodes that are passed over, whichever they are.
TEST(BlockSubstitution, OfLoadsOnSomeUnknownsEqualsADenseSolve) {
  for (int loaded = 0; loaded < 32; ++loaded) {
    MatrixXd b = MatrixXd::Zero(5, 2);
    for (int i = 0; i < 5; ++i) {
      if ((loaded >> i & 1) != 0) b(i, i % 2) = 1.0 + i;
    }
    expect_solved(Factor(), b);
  }
}

TEST(BlockSubstitution, ScratchServesBlocksOfAnySize) {
  const Factor factor;
  MatrixXd scratch;
  for (const Eigen::Index columns : {4, 1, 0, 7}) {
    const MatrixXd b = MatrixXd::Ones(5, columns);
    MatrixXd x = b.transpose();
    substitute(factor.view(), x, scratch);
    if (columns == 0) continue;
    EXPECT_LT((x.transpose() - factor.solve(b)).norm(), 1e-13);
  }
}

}  // namespace
}  // namespace brainshift::linalg
