// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/checked_solve.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "common/fem/elasticity.hpp"
#include "common/fem/stiffness_factor.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"

namespace brainshift::linalg {
namespace {

using test_support::box_mesh;
using test_support::nodes_where;

constexpr fem::Elasticity kSolvedTissue{0.0242, 0.0021};

struct SolvedBlock {
  TetMesh mesh = box_mesh(3, 3, 3, Vec3(30, 30, 30));
  fem::DofMap dofs{mesh.num_nodes()};
  SymmetricMatrix stiffness;
  SolvedBlock() {
    for (NodeIndex n : nodes_where(mesh, [](const Vec3& x) { return x[2] == 0.0; }))
      dofs.fix_all(n);
    dofs.finalise();
    stiffness = fem::assemble_stiffness(mesh, kSolvedTissue, dofs);
  }
  VecX load() const {
    std::srand(17);
    return VecX::Random(dofs.num_unknowns());
  }
  // The factor of a matrix that differs by `relative` in stiffness at one corner.
  SparseCholesky factor_of_another(double relative) const {
    SymmetricMatrix other = stiffness;
    fem::add_to_node_block(other, dofs, mesh.num_nodes() - 1,
                           relative * max_norm(stiffness) * Mat3::Identity());
    return std::move(*SparseCholesky::factorise(other));
  }
};

TEST(CheckedSolve, NormIsTheGreatestRowSum) {
  const SolvedBlock block;
  const SymmetricMatrix whole = block.stiffness.selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd full(whole);
  EXPECT_NEAR(max_norm(block.stiffness), full.cwiseAbs().rowwise().sum().maxCoeff(), 1e-12);
}

TEST(CheckedSolve, AFittingFactorNeedsNoRefinement) {
  const SolvedBlock block;
  const auto factor = SparseCholesky::factorise(block.stiffness);
  const VecX b = block.load();
  VecX x;
  const auto quality =
      value_or_fail(checked_solve(block.stiffness, max_norm(block.stiffness), *factor, b, x));
  EXPECT_EQ(quality.refinements, 0);
  EXPECT_LT(quality.backward_error, 1e-15);
  EXPECT_LT((multiply(block.stiffness, x) - b).norm(), 1e-13 * b.norm());
}

TEST(CheckedSolve, RefinesWhatASlightlyWrongFactorDid) {
  const SolvedBlock block;
  const SparseCholesky factor = block.factor_of_another(1e-7);
  const auto right = SparseCholesky::factorise(block.stiffness);
  const VecX b = block.load();
  VecX x;
  const auto quality =
      value_or_fail(checked_solve(block.stiffness, max_norm(block.stiffness), factor, b, x));
  EXPECT_GE(quality.refinements, 1);
  const VecX expected = right->solve(b);
  EXPECT_GT((factor.solve(b) - expected).norm(), 1e-9 * expected.norm());
  EXPECT_LT((x - expected).norm(), 1e-12 * expected.norm());
}

TEST(CheckedSolve, RejectsTheFactorOfAnotherMatrix) {
  const SolvedBlock block;
  const SparseCholesky factor = block.factor_of_another(10.0);
  VecX x;
  EXPECT_THAT(
      refusal_of(checked_solve(block.stiffness, max_norm(block.stiffness), factor, block.load(), x),
                 ErrorCode::kSingularMatrix),
      testing::HasSubstr("backward error"));
}

TEST(CheckedSolve, RejectsARightHandSideThatIsNotFinite) {
  const SolvedBlock block;
  const auto factor = SparseCholesky::factorise(block.stiffness);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    VecX b = block.load(), x;
    b[7] = bad;
    refusal_of(checked_solve(block.stiffness, max_norm(block.stiffness), *factor, b, x),
               ErrorCode::kNotFinite);
  }
  VecX b = VecX::Constant(block.dofs.num_unknowns(), 1e308), x;
  refusal_of(checked_solve(block.stiffness, max_norm(block.stiffness), *factor, b, x),
             ErrorCode::kNotFinite);
}

TEST(CheckedSolve, OneWrongSolutionAmongManyIsFoundAndRefined) {
  const SolvedBlock block;
  const auto factor = SparseCholesky::factorise(block.stiffness);
  const double norm = max_norm(block.stiffness);
  std::srand(3);
  const Eigen::MatrixXd b = Eigen::MatrixXd::Random(9, block.dofs.num_unknowns());
  const Eigen::MatrixXd expected = factor->solve_rows(b);
  SparseCholesky::Workspace workspace;
  for (const int wrong : {0, 4, 8}) {
    Eigen::MatrixXd x = expected;
    x(wrong, 11) += 1e-6;
    const auto quality = value_or_fail(check_rows(block.stiffness, norm, *factor, b, x, workspace));
    EXPECT_GE(quality.refinements, 1);
    EXPECT_LT((x - expected).norm(), 1e-12 * expected.norm());
  }
  Eigen::MatrixXd x = expected;
  EXPECT_EQ(check_rows(block.stiffness, norm, *factor, b, x, workspace)->refinements, 0);
}

TEST(CheckedSolve, BlocksOfAnotherMatrixAreRejected) {
  const SolvedBlock block;
  const fem::StiffnessFactor factor(block.factor_of_another(10.0));
  fem::BlockSolver solver(block.stiffness, factor, block.dofs);
  Eigen::MatrixXd u;
  refusal_of(solver.solve(Eigen::MatrixXd::Ones(5, 3 * block.mesh.num_nodes()), u),
             ErrorCode::kSingularMatrix);
}

}  // namespace
}  // namespace brainshift::linalg
