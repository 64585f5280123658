// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "common/core/thread_team.hpp"
#include "common/linalg/blas.hpp"
#include "tests/support/dense.hpp"

namespace brainshift::linalg {
namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXf;

// Sums of up to 9 products of numbers below 1: a few roundings.
constexpr double kRounding = 1e-14;
constexpr float kFloatRounding = 1e-5f;

// Eigen's own products are the reference. A and B are blocks of larger matrices, so that the
// leading dimension is not the number of rows.
struct Blocks {
  MatrixXd storage_a, storage_b;
  Blocks() {
    std::srand(11);
    storage_a = MatrixXd::Random(12, 10);
    storage_b = MatrixXd::Random(12, 10);
  }
  auto a() const { return storage_a.block(1, 2, 7, 5); }
  auto b() const { return storage_b.block(3, 1, 5, 4); }
};

TEST(Blas, MultipliesBlocks) {
  const Blocks blocks;
  const MatrixXd before = MatrixXd::Random(7, 4);
  MatrixXd c = before;
  blas::multiply(2.0, blocks.a(), blocks.b(), 0.5, c);
  EXPECT_LT((c - (2.0 * blocks.a() * blocks.b() + 0.5 * before)).norm(), kRounding);
  MatrixXf single = before.cast<float>();
  const MatrixXf a = blocks.a().cast<float>(), b = blocks.b().cast<float>();
  blas::multiply(2.0f, a, b, 0.5f, single);
  EXPECT_LT((single - c.cast<float>()).norm(), kFloatRounding);
}

TEST(Blas, MultipliesTransposedBlocks) {
  const Blocks blocks;
  const MatrixXd before = MatrixXd::Random(5, 3);
  MatrixXd c = before;
  const MatrixXd b = MatrixXd::Random(7, 3);
  blas::multiply_transposed(-1.5, blocks.a(), b, 2.0, c);
  EXPECT_LT((c - (-1.5 * blocks.a().transpose() * b + 2.0 * before)).norm(), kRounding);
}

TEST(Blas, GramAddsToTheLowerTriangleOnly) {
  const Blocks blocks;
  const MatrixXd before = MatrixXd::Random(5, 5);
  MatrixXd c = before;
  blas::gram(blocks.a(), 0.5, c);
  const MatrixXd expected = blocks.a().transpose() * blocks.a() + 0.5 * before;
  for (int j = 0; j < 5; ++j) {
    for (int i = 0; i < 5; ++i) {
      EXPECT_NEAR(c(i, j), i >= j ? expected(i, j) : before(i, j), kRounding);
    }
  }
}

TEST(Blas, CholeskyAndItsTriangularSolves) {
  const Blocks blocks;
  const MatrixXd spd = blocks.a().transpose() * blocks.a() + MatrixXd::Identity(5, 5);
  MatrixXd l = spd;
  ASSERT_TRUE(blas::cholesky(l));
  const MatrixXd lower = l.triangularView<Eigen::Lower>();
  EXPECT_LT((lower * lower.transpose() - spd).norm(), 10 * kRounding);
  const MatrixXd b = MatrixXd::Random(5, 3);
  MatrixXd x = b;
  blas::solve_lower(l, x);
  EXPECT_LT((lower * x - b).norm(), kRounding);
  blas::solve_lower_transposed(l, x);
  EXPECT_LT((spd * x - b).norm(), 10 * kRounding);
  const MatrixXf row = MatrixXf::Random(3, 5), single = lower.cast<float>();
  MatrixXf y = row;
  blas::solve_lower_transposed_right(single, y);
  EXPECT_LT((y * single.transpose() - row).norm(), kFloatRounding);
}

TEST(Blas, OrthonormalColumnsSpanTheSame) {
  const Blocks blocks;
  const MatrixXd given = blocks.a();
  MatrixXd storage = blocks.storage_a;
  auto q = storage.block(1, 2, 7, 5);
  blas::orthonormalise(q);
  EXPECT_LT((q.transpose() * q - MatrixXd::Identity(5, 5)).norm(), kRounding);
  EXPECT_LT((q * (q.transpose() * given) - given).norm(), kRounding);
  storage.block(1, 2, 7, 5) = given;
  EXPECT_EQ(storage, blocks.storage_a) << "numbers beside the block have changed";
  MatrixXd none(4, 0);
  blas::orthonormalise(none);
}

// b^T (shift + A)^-1 b and the trace are the same for T and Q^T b.
TEST(Blas, TridiagonalMatrixStandsForTheGivenOne) {
  std::srand(12);
  for (const Eigen::Index n : {1, 2, 3, 9}) {
    const MatrixXd random = MatrixXd::Random(n, n), a = random * random.transpose();
    const Eigen::VectorXd b = Eigen::VectorXd::Random(n);
    MatrixXd overwritten = a;
    overwritten.triangularView<Eigen::StrictlyUpper>().setConstant(7.0);  // not read
    Eigen::VectorXd turned = b, diagonal(n), beside(n - 1), scales(n - 1);
    blas::tridiagonalise(overwritten, turned, diagonal, beside, scales);
    MatrixXd t = diagonal.asDiagonal();
    if (n > 1) t.diagonal(1) = t.diagonal(-1) = beside;
    EXPECT_NEAR(t.trace(), a.trace(), kRounding * a.trace());
    for (const double shift : {0.5, 3.0}) {
      const MatrixXd unit = shift * MatrixXd::Identity(n, n);
      EXPECT_NEAR(turned.dot(test_support::solve(unit + t, turned).col(0)),
                  b.dot(test_support::solve(unit + a, b).col(0)), 10.0 * kRounding);
    }
  }
}

TEST(Blas, CholeskyRejectsAnIndefiniteMatrix) {
  MatrixXd indefinite = MatrixXd::Identity(4, 4);
  indefinite(2, 2) = -1.0;
  EXPECT_FALSE(blas::cholesky(indefinite));
}

TEST(Blas, AddsScaledVectors) {
  const Eigen::VectorXd x = Eigen::VectorXd::Random(9), before = Eigen::VectorXd::Random(9);
  Eigen::VectorXd y = before;
  blas::add_scaled(8, -0.5, x.data(), y.data());
  EXPECT_LT((y - before + 0.5 * x).head(8).norm(), kRounding);
  EXPECT_EQ(y[8], before[8]);
  Eigen::VectorXf single = before.cast<float>();
  const Eigen::VectorXf xf = x.cast<float>();
  blas::add_scaled(8, -0.5f, xf.data(), single.data());
  EXPECT_LT((single - y.cast<float>()).norm(), kFloatRounding);
}

using Eigen::Index;

// Well conditioned, and not of a size that the blocks divide.
MatrixXd positive_definite(Index size) {
  std::srand(3);
  const MatrixXd a = MatrixXd::Random(size, size);
  return a * a.transpose() + static_cast<double>(size) * MatrixXd::Identity(size, size);
}

MatrixXd team_lower(const MatrixXd& a) { return a.triangularView<Eigen::Lower>(); }

TEST(TeamCholesky, IsTheFactorOfAnotherLibrary) {
  ThreadTeam team(2);
  for (const Index size : {0, 1, 37, 257, 611}) {
    const MatrixXd a = positive_definite(size);
    MatrixXd l = a;
    ASSERT_TRUE(cholesky(l, team));
    const MatrixXd expected = test_support::cholesky_factor(a);
    EXPECT_LE((team_lower(l) - expected).norm(), 1e-13 * (1.0 + expected.norm())) << size;
  }
}

TEST(TeamCholesky, DoesNotDependOnTheNumberOfMembers) {
  const MatrixXd a = positive_definite(700);
  ThreadTeam one(1), three(3);
  MatrixXd by_one = a, by_three = a;
  ASSERT_TRUE(cholesky(by_one, one));
  ASSERT_TRUE(cholesky(by_three, three));
  EXPECT_EQ(team_lower(by_one), team_lower(by_three));
}

TEST(TeamCholesky, WorksOnABlockOfALargerMatrix) {
  ThreadTeam team(2);
  const MatrixXd a = positive_definite(300);
  MatrixXd larger = MatrixXd::Constant(310, 305, 7.0);
  larger.block(4, 2, 300, 300) = a;
  ASSERT_TRUE(cholesky(larger.block(4, 2, 300, 300), team));
  EXPECT_LE((team_lower(larger.block(4, 2, 300, 300)) - MatrixXd(test_support::cholesky_factor(a)))
                .norm(),
            1e-10);
  larger.block(4, 2, 300, 300).setConstant(7.0);
  EXPECT_EQ(larger, MatrixXd::Constant(310, 305, 7.0));
}

TEST(TeamCholesky, RefusesAnIndefiniteMatrixWhereverItIsOne) {
  ThreadTeam team(2);
  for (const Index place : {0, 150, 399}) {
    MatrixXd a = positive_definite(400);
    a(place, place) = -1.0;
    EXPECT_FALSE(cholesky(a, team)) << place;
  }
}

}  // namespace
}  // namespace brainshift::linalg
