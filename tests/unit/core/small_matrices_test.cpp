// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/core/small_matrices.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

namespace brainshift {
namespace {

// A = V diag(values) V^T, V a product of turns.
Mat3 symmetric(const Vec3& values) {
  const Mat3 V =
      (Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()) * Eigen::AngleAxisd(-1.1, Vec3::UnitX()))
          .toRotationMatrix();
  return V * values.asDiagonal() * V.transpose();
}

TEST(SmallMatrices, EigenvaluesAscendAndTheirVectorsRebuildTheMatrix) {
  const Vec3 values(-2.0, 0.5, 7.0);
  const Mat3 A = symmetric(values);
  const SymmetricEigen<3> eigen = symmetric_eigen(A);
  EXPECT_TRUE(eigen.values.isApprox(values, 1e-14));
  EXPECT_TRUE(symmetric_eigenvalues(A).isApprox(values, 1e-14));
  EXPECT_TRUE((eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose()).isApprox(A));
  EXPECT_TRUE((eigen.vectors.transpose() * eigen.vectors).isIdentity(1e-14));
}

TEST(SmallMatrices, OnlyTheLowerTriangleIsRead) {
  Mat6 A = Mat6::Zero();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) A(i, j) = 1.0 / (1 + i + j);  // Hilbert's
  const Mat6 whole = A.selfadjointView<Eigen::Lower>();
  A.triangularView<Eigen::StrictlyUpper>().setConstant(1e9);
  const SymmetricEigen<6> eigen = symmetric_eigen(A);
  EXPECT_TRUE((whole * eigen.vectors).isApprox(eigen.vectors * eigen.values.asDiagonal(), 1e-13));
  EXPECT_TRUE(symmetric_eigenvalues(A).isApprox(eigen.values, 1e-13));
}

TEST(SmallMatrices, SingularValuesDescendAndRebuildTheMatrix) {
  Mat3 A;
  A << 1, 2, 0, -3, 4, 1, 0, 0.5, -2;
  const SingularValues svd = singular_values(A);
  EXPECT_GT(svd.values[0], svd.values[1]);
  EXPECT_GT(svd.values[1], svd.values[2]);
  EXPECT_TRUE((svd.U * svd.values.asDiagonal() * svd.V.transpose()).isApprox(A, 1e-14));
  EXPECT_NEAR(svd.values.prod(), std::abs(A.determinant()), 1e-13);
}

TEST(SmallMatrices, TheSolutionOfASingularSystemHasNoPartThatTheMatrixDoesNotSee) {
  const Mat3 A = symmetric(Vec3(0.0, 2.0, 5.0));
  const Mat3 B = symmetric(Vec3(1.0, 1.0, 2.0)) + 0.1 * Mat3::Ones();
  const Vec3 unseen = symmetric_eigen(A).vectors.col(0);
  const Mat3 X = least_norm_solution(A, B);
  EXPECT_LT((unseen.transpose() * X).norm(), 1e-14);
  EXPECT_LT((A * (A * X - B)).norm(), 1e-13);  // the normal equations
  EXPECT_TRUE(X.isApprox(A.completeOrthogonalDecomposition().solve(B), 1e-13));
}

TEST(SmallMatrices, InverseOfAPositiveDefiniteMatrix) {
  Mat6 A = Mat6::Identity();
  for (int i = 0; i < 6; ++i) A(i, i) = 1.0 + i;
  A(4, 1) = A(1, 4) = 0.3;
  EXPECT_TRUE((A * symmetric_inverse(A)).isIdentity(1e-14));
}

}  // namespace
}  // namespace brainshift
