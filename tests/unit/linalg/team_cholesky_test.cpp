// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/team_cholesky.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

namespace brainshift::linalg {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

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
    const MatrixXd expected = a.llt().matrixL();
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
  EXPECT_LE((team_lower(larger.block(4, 2, 300, 300)) - MatrixXd(a.llt().matrixL())).norm(), 1e-10);
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
