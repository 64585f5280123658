// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/growing_matrix.hpp"

#include <gtest/gtest.h>

namespace brainshift::linalg {
namespace {

using Eigen::MatrixXd;

TEST(GrowingMatrix, KeepsItsMemoryWhenItShrinks) {
  GrowingMatrix a;
  EXPECT_EQ(a.size(), 0);
  a.resize(6, 5);
  const double* memory = a.data();
  a.resize(3, 2);
  EXPECT_EQ(a.rows(), 3);
  EXPECT_EQ(a.cols(), 2);
  EXPECT_EQ(a.data(), memory);
  a.resize(5, 6);
  EXPECT_EQ(a.data(), memory);
  a.resize(7, 7);
  EXPECT_EQ(a.rows(), 7);
}

TEST(GrowingMatrix, TakesShapeAndValueOfAnExpression) {
  const MatrixXd b = MatrixXd::Random(4, 3), c = MatrixXd::Random(3, 2);
  GrowingMatrix a;
  a = b * c;
  EXPECT_EQ(MatrixXd(a), MatrixXd(b * c));
  a = b.transpose();
  EXPECT_EQ(MatrixXd(a), MatrixXd(b.transpose()));
}

TEST(GrowingMatrix, ACopyHasMemoryOfItsOwn) {
  GrowingMatrix a;
  a = MatrixXd::Constant(2, 2, 1.0);
  GrowingMatrix copy = a, assigned;
  assigned = a;
  a.setConstant(5.0);
  EXPECT_EQ(MatrixXd(copy), MatrixXd::Constant(2, 2, 1.0));
  EXPECT_EQ(MatrixXd(assigned), MatrixXd::Constant(2, 2, 1.0));
}

TEST(GrowingVector, IsAVector) {
  GrowingVector a;
  EXPECT_EQ(a.size(), 0);
  a.resize(5);
  const double* memory = a.data();
  a = Eigen::VectorXd::LinSpaced(3, 1.0, 3.0);
  EXPECT_EQ(a.data(), memory);
  EXPECT_EQ(a.head(2).sum(), 3.0);
}

}  // namespace
}  // namespace brainshift::linalg
