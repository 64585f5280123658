// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "common/core/random.hpp"
#include "common/fem/elasticity.hpp"
#include "common/linalg/cholesky.hpp"
#include "common/linalg/symmetric_matrix.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/dense.hpp"
#include "tests/support/results.hpp"

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
    return test_support::solve(dense * dense.transpose(), b);
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

using test_support::box_mesh;
using test_support::nodes_where;

constexpr fem::Elasticity kTissue{0.0242, 0.0021};

// A block standing on a fixed floor.
struct Block {
  TetMesh mesh = box_mesh(3, 3, 3, Vec3(30, 30, 30));
  fem::DofMap dofs{mesh.num_nodes()};
  Block() {
    for (NodeIndex n : nodes_where(mesh, [](const Vec3& x) { return x[2] == 0.0; }))
      dofs.fix_all(n);
    dofs.finalise();
  }
  SymmetricMatrix stiffness() const { return fem::assemble_stiffness(mesh, kTissue, dofs); }
};

VecX random_vector(int n) {
  std::srand(17);
  return VecX::Random(n);
}

TEST(SparseCholesky, SolvesToBackwardErrorOfRoundingSize) {
  const Block block;
  const SymmetricMatrix k = block.stiffness();
  const auto factor = value_or_fail(SparseCholesky::factorise(k));
  const VecX b = random_vector(block.dofs.num_unknowns());
  const VecX x = factor.solve(b);
  const double backward = (multiply(k, x) - b).norm() / (k.norm() * x.norm() + b.norm());
  EXPECT_LT(backward, 1e-15);
  EXPECT_GT(factor.rcond(), 1e-6);
  EXPECT_GT(factor.nonzeros(), static_cast<std::uint64_t>(block.dofs.num_unknowns()));
}

TEST(SparseCholesky, ManyRightHandSidesEqualSingleSolves) {
  const Block block;
  const auto factor = value_or_fail(SparseCholesky::factorise(block.stiffness()));
  std::srand(3);
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(7, block.dofs.num_unknowns());
  const Eigen::MatrixXd x = factor.solve_rows(b);
  for (int c = 0; c < 7; ++c) {
    const VecX single = factor.solve(VecX(b.row(c).transpose()));
    EXPECT_LT((x.row(c).transpose() - single).norm(), 1e-12 * single.norm());
  }
}

TEST(SparseCholesky, RefactorisedCloneEqualsAFreshFactorAndLeavesTheOriginalAlone) {
  const Block block;
  const SymmetricMatrix k = block.stiffness();
  SymmetricMatrix stiffer = k;
  fem::add_to_node_block(stiffer, block.dofs, block.mesh.num_nodes() - 1, 0.5 * Mat3::Identity());
  const auto original = value_or_fail(SparseCholesky::factorise(k));
  SparseCholesky clone = original.clone_analysis();
  ASSERT_TRUE(clone.refactorise(stiffer).has_value());
  const auto fresh = value_or_fail(SparseCholesky::factorise(stiffer));
  const VecX b = random_vector(block.dofs.num_unknowns());
  const VecX expected = fresh.solve(b);
  EXPECT_LT((clone.solve(b) - expected).norm(), 1e-12 * expected.norm());
  EXPECT_GT((original.solve(b) - expected).norm(), 1e-3 * expected.norm());
}

TEST(SparseCholesky, RejectsABodyThatFloats) {
  const TetMesh mesh = box_mesh(3, 3, 3, Vec3(30, 30, 30));
  fem::DofMap dofs(mesh.num_nodes());
  dofs.finalise();
  refusal_of(SparseCholesky::factorise(fem::assemble_stiffness(mesh, kTissue, dofs)),
             ErrorCode::kFloatingBody);
}

TEST(SparseCholesky, RejectsABodyThatCanOnlySlide) {
  const TetMesh mesh = box_mesh(3, 3, 3, Vec3(30, 30, 30));
  fem::DofMap dofs(mesh.num_nodes());
  for (NodeIndex n : nodes_where(mesh, [](const Vec3& x) { return x[2] == 0.0; })) {
    dofs.fix_normal(n, Vec3::UnitZ());
  }
  dofs.finalise();
  refusal_of(SparseCholesky::factorise(fem::assemble_stiffness(mesh, kTissue, dofs)),
             ErrorCode::kFloatingBody);
}

TEST(SparseCholesky, RejectsNumbersThatAreNotFinite) {
  const Block block;
  for (double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (long entry : {0L, 100L}) {
      SymmetricMatrix k = block.stiffness();
      k.valuePtr()[entry] = bad;
      refusal_of(SparseCholesky::factorise(k), ErrorCode::kNotFinite);
      auto good = value_or_fail(SparseCholesky::factorise(block.stiffness()));
      EXPECT_EQ(good.refactorise(k).error().code, ErrorCode::kNotFinite);
    }
  }
}

TEST(SparseCholesky, RejectsAnIndefiniteMatrix) {
  const Block block;
  SymmetricMatrix k = block.stiffness();
  k.coeffRef(5, 5) = -1.0;
  refusal_of(SparseCholesky::factorise(k), ErrorCode::kFloatingBody);
}

// Springs at three corners: answers are off by 1e-14 over their stiffness, relative to the
// body's.
TEST(SparseCholesky, RejectsABodyThatSpringsHardlyHold) {
  const TetMesh mesh = box_mesh(3, 3, 3, Vec3(30, 30, 30));
  fem::DofMap dofs(mesh.num_nodes());
  dofs.finalise();
  const SymmetricMatrix body = fem::assemble_stiffness(mesh, kTissue, dofs);
  const auto held = [&](double stiffness) {
    SymmetricMatrix k = body;
    for (const NodeIndex n : {0, 3, 15}) {
      fem::add_to_node_block(k, dofs, n, stiffness * Mat3::Identity());
    }
    return SparseCholesky::factorise(k);
  };
  EXPECT_TRUE(held(1e-8).has_value());
  for (const double stiffness : {1e-13, 1e-14}) {
    const auto factor = held(stiffness);
    ASSERT_FALSE(factor.has_value()) << stiffness;
    EXPECT_EQ(factor.error().code, ErrorCode::kFloatingBody);
  }
}

TEST(SparseCholesky, StiffContactSpringsAreAccepted) {
  const Block block;
  SymmetricMatrix k = block.stiffness();
  fem::add_to_node_block(k, block.dofs, block.mesh.num_nodes() - 1, 1e9 * Mat3::Identity());
  EXPECT_TRUE(SparseCholesky::factorise(k).has_value());
}

TEST(SparseCholesky, RejectsEntriesAboveTheDiagonal) {
  const Block block;
  SymmetricMatrix k = block.stiffness();
  const SymmetricMatrix upper = k.transpose();
  for (const SymmetricMatrix& bad : {upper, SymmetricMatrix(k + upper)}) {
    refusal_of(SparseCholesky::factorise(bad), ErrorCode::kInvalidArgument);
  }
}

TEST(SparseCholesky, RejectsASystemWithoutUnknowns) {
  EXPECT_EQ(SparseCholesky::factorise(SymmetricMatrix(0, 0)).error().code, ErrorCode::kEmptySet);
}

// [ 2 -1 0 ; -1 3 4 ; 0 4 -5 ] by its lower triangle.
SymmetricMatrix lower() {
  SymmetricMatrix matrix(3, 3);
  const std::vector<Eigen::Triplet<double>> entries = {
      {0, 0, 2.0}, {1, 0, -1.0}, {1, 1, 3.0}, {2, 1, 4.0}, {2, 2, -5.0}};
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

TEST(SymmetricMatrix, MultipliesByTheWholeMatrix) {
  EXPECT_EQ(multiply(lower(), Vec3(1.0, 2.0, 3.0)), VecX(Vec3(0.0, 17.0, -7.0)));
}

TEST(SymmetricMatrix, NormIsTheLargestRowSumOfTheWholeMatrix) {
  EXPECT_EQ(max_norm(lower()), 9.0);  // of the last row
  EXPECT_EQ(max_norm(SymmetricMatrix()), 0.0);
}

}  // namespace
}  // namespace brainshift::linalg
